# What every target of this project has in common: language level, warnings, include paths.
function(ear_target target)
  target_compile_features(${target} PUBLIC cxx_std_17)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wconversion -Wshadow
                                           $<$<BOOL:${EAR_WARNINGS_AS_ERRORS}>:-Werror>)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
                                              $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
                                       PRIVATE ${PROJECT_SOURCE_DIR})
  get_target_property(type ${target} TYPE)
  if(TARGET ear_precompiled AND type STREQUAL "STATIC_LIBRARY")
    target_precompile_headers(${target} REUSE_FROM ear_precompiled)
  endif()
endfunction()
