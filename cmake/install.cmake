# The installed package: find_package(ear) gives ear::ear (class Odometry), and ear::filter (the estimator alone, which
# needs Eigen only and is included as "filter/...").
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/ear)

# The filter's headers get a root of their own, so that nothing else comes onto the include path with them.
set(filter_include_dir ${CMAKE_INSTALL_INCLUDEDIR}/ear-filter)
target_include_directories(ear_filter INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                                $<INSTALL_INTERFACE:${filter_include_dir}>)

foreach(part IN ITEMS ear filter frontend log)
  set(target ear)
  if(NOT part STREQUAL ear)
    set(target ear_${part})
  endif()
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${part})
  add_library(ear::${part} ALIAS ${target})
  install(TARGETS ${target} EXPORT ear ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
                                       LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
endforeach()
if(EAR_BUILD_TOOLS)
  install(TARGETS ear_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ear DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/filter DESTINATION ${filter_include_dir} FILES_MATCHING PATTERN "*.h")
install(EXPORT ear NAMESPACE ear:: FILE earTargets.cmake DESTINATION ${package_dir})

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/earConfig.cmake.in ${PROJECT_BINARY_DIR}/earConfig.cmake
                              INSTALL_DESTINATION ${package_dir} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/earConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/earConfig.cmake ${PROJECT_BINARY_DIR}/earConfigVersion.cmake
        DESTINATION ${package_dir})
