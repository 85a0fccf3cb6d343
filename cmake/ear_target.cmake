# What every target of this project has in common: language level, warnings, include paths.
function(ear_target target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wconversion -Wshadow
                                           $<$<BOOL:${EAR_WARNINGS_AS_ERRORS}>:-Werror>)
  # Above 128 states Eigen's stack check is too small for the fixed-capacity covariance.
  target_compile_definitions(${target} PUBLIC EIGEN_STACK_ALLOCATION_LIMIT=0)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
                                              $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
                                       PRIVATE ${PROJECT_SOURCE_DIR})
endfunction()
