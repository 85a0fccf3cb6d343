# The installed package: find_package(ear) gives ear::ear (class Odometry), and ear::filter (the estimator alone, which
# needs Eigen only and is included as "filter/..."). find_package(ear COMPONENTS filter) looks for Eigen only. With
# EAR_FILTER_ONLY there is no other part. ear::mavlink, ear::recording and ear::live are what the ear program is made of.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/ear)

# The filter's headers get a root of their own, so that nothing else comes onto the include path with them.
set(filter_include_dir ${CMAKE_INSTALL_INCLUDEDIR}/ear-filter)
target_include_directories(ear_filter INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                                $<INSTALL_INTERFACE:${filter_include_dir}>)

# Headers of what is not built would only break at linking.
set(not_installed "")
if(EAR_FILTER_ONLY)
  set(EAR_PACKAGE_PARTS filter)
  set(not_installed PATTERN ear_c.h EXCLUDE PATTERN odometry.h EXCLUDE)
else()
  set(EAR_PACKAGE_PARTS ear filter frontend log recording mavlink live)
  foreach(part ros2 rosbag2 dds)  # as they were built
    if(TARGET ear_${part})
      list(APPEND EAR_PACKAGE_PARTS ${part})
    endif()
  endforeach()
  # The headers of what the ear program is made of have a root of their own, too: <src/mavlink/link.h>.
  set(source_include_dir ${CMAKE_INSTALL_INCLUDEDIR}/ear-src)
  foreach(part IN LISTS EAR_PACKAGE_PARTS)
    if(NOT part MATCHES "^(ear|filter|frontend)$")
      target_include_directories(ear_${part} INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                                       $<INSTALL_INTERFACE:${source_include_dir}>)
    endif()
  endforeach()
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/src DESTINATION ${source_include_dir} FILES_MATCHING PATTERN "*.h"
          PATTERN "view" EXCLUDE)  # a part of the ear program alone
endif()
foreach(part IN LISTS EAR_PACKAGE_PARTS)
  set(target ear)
  if(NOT part STREQUAL ear)
    set(target ear_${part})
  endif()
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${part})
  add_library(ear::${part} ALIAS ${target})
  install(TARGETS ${target} EXPORT ear ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
                                       LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
endforeach()
if(TARGET ear_program)
  install(TARGETS ear_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  configure_file(${CMAKE_CURRENT_LIST_DIR}/ear-live.service.in ${PROJECT_BINARY_DIR}/ear-live.service @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/ear-live.service DESTINATION lib/systemd/system)
endif()

install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/ear DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} ${not_installed})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/filter DESTINATION ${filter_include_dir} FILES_MATCHING PATTERN "*.h")
install(EXPORT ear NAMESPACE ear:: FILE earTargets.cmake DESTINATION ${package_dir})

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/earConfig.cmake.in ${PROJECT_BINARY_DIR}/earConfig.cmake
                              INSTALL_DESTINATION ${package_dir} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/earConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/earConfig.cmake ${PROJECT_BINARY_DIR}/earConfigVersion.cmake
        DESTINATION ${package_dir})
