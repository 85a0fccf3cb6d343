add_library(doctest_main OBJECT ${PROJECT_SOURCE_DIR}/tests/support/main.cpp)
ear_target(doctest_main)
target_link_libraries(doctest_main PUBLIC doctest::doctest)

# The headers of all doctest programs, compiled once (cmake/quick_build.cmake). Without doctest's own: glog, which comes
# with Ceres, has a CHECK too, and the one that is included later counts.
if(EAR_QUICK_BUILD)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled_tests.cpp CONTENT "// Its headers are what counts.\n")
  add_executable(ear_precompiled_tests ${PROJECT_BINARY_DIR}/precompiled_tests.cpp)
  ear_target(ear_precompiled_tests)
  target_link_libraries(ear_precompiled_tests PRIVATE doctest_main Eigen3::Eigen)
  target_precompile_headers(ear_precompiled_tests PRIVATE ${EAR_COMMON_HEADERS})
endif()

# What `tools/test --asan` builds and runs: the unit tests of these folders, their ctest label is `sanitized` too. Not those
# labelled accuracy: for a figure of simulated drives they run over and over the code that the others have run. And not
# those of smoother and evaluation, which no vehicle runs.
set(EAR_SANITIZED_FOLDERS ear filter frontend recording ros2 rosbag2 odometry view fuzz CACHE STRING "For EAR_SANITIZE")
add_custom_target(sanitized_tests)

# ear_register(TARGET NAME LABEL TIMEOUT): what all tests have in common.
function(ear_register target name label timeout)
  if(CMAKE_CROSSCOMPILING OR EAR_SANITIZE)
    math(EXPR timeout "10 * ${timeout}")  # emulated, or with all checks
  endif()
  get_filename_component(folder ${CMAKE_CURRENT_SOURCE_DIR} NAME)
  if("${label}" STREQUAL "unit" AND folder IN_LIST EAR_SANITIZED_FOLDERS)  # quoted: loops have a variable `unit`
    add_dependencies(sanitized_tests ${target})
    list(APPEND label sanitized)
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "${label}" TIMEOUT ${timeout})
endfunction()

# ear_test(NAME name SOURCES a.cpp ... LIBRARIES target ... [LABEL unit|accuracy|consistency|replay|bench] [TIMEOUT s]
#          [ARGUMENTS of the program ...])
# builds one doctest program and gives it to ctest: a test source cannot be built and forgotten.
function(ear_test)
  cmake_parse_arguments(arg "" "NAME;LABEL;TIMEOUT" "SOURCES;LIBRARIES;ARGUMENTS" ${ARGN})
  if(NOT arg_LABEL)
    set(arg_LABEL unit)
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif()
  set(target test_${arg_NAME})
  add_executable(${target} ${arg_SOURCES})
  ear_target(${target})
  target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
  target_link_libraries(${target} PRIVATE doctest_main ${arg_LIBRARIES})
  target_compile_definitions(${target} PRIVATE EAR_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
                                               $<$<BOOL:${EAR_SANITIZE}>:EAR_SANITIZED>)
  if(TARGET ear_precompiled_tests)
    target_precompile_headers(${target} REUSE_FROM ear_precompiled_tests)
  endif()
  add_test(NAME ${arg_NAME} COMMAND ${target} ${arg_ARGUMENTS})
  ear_register(${target} ${arg_NAME} ${arg_LABEL} ${arg_TIMEOUT})
  set_tests_properties(${arg_NAME} PROPERTIES SKIP_RETURN_CODE 77)  # see tests/support/skip.h
endfunction()
