# A first build in less time: common headers are compiled once, and small sources several at a time. No source may rely on
# what others include: the presets debug, fuzz and tidy build without. EAR_QUICK_BUILD turns it off.
option(EAR_QUICK_BUILD "Compile common headers once and small sources together; needs more care from caches of compilers" ON)

# With Eigen the headers are 0.6 to 0.8 s of each source. One compiled header serves all libraries, since these are
# compiled with the same flags; programs are not (-fPIE), and the tests have their own (tests/doctest_main.cmake).
if(EAR_QUICK_BUILD)
  # ccache (4.0 and later) takes part only where it may disregard that such a file holds macros and a time; and the
  # language of messages, which CTest's builds change.
  if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES "(^|/)ccache$")
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=locale,pch_defines,time_macros
                                    ${CMAKE_CXX_COMPILER_LAUNCHER})
  endif()

  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled.cpp CONTENT "// Its headers are what counts.\n")
  add_library(ear_precompiled OBJECT ${PROJECT_BINARY_DIR}/precompiled.cpp)
  target_compile_features(ear_precompiled PRIVATE cxx_std_17)
  set_target_properties(ear_precompiled PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_link_libraries(ear_precompiled PRIVATE Eigen3::Eigen)
  set(EAR_COMMON_HEADERS <Eigen/Cholesky> <Eigen/Core> <Eigen/Geometry> <Eigen/LU> <algorithm> <array> <cmath> <cstdint>
                         <filesystem> <functional> <map> <memory> <optional> <stdexcept> <string> <utility> <variant>
                         <vector>)
  target_precompile_headers(ear_precompiled PRIVATE ${EAR_COMMON_HEADERS})
endif()

# Programs and tests are many, and each holds all libraries: lld links one in a tenth of the time. It cannot read what g++
# leaves for optimisation at link time.
if(EAR_QUICK_BUILD AND PROJECT_IS_TOP_LEVEL AND NOT CMAKE_CROSSCOMPILING AND NOT CMAKE_INTERPROCEDURAL_OPTIMIZATION
   AND NOT CMAKE_CXX_FLAGS MATCHES "-flto")
  find_program(EAR_LLD ld.lld)
  if(EAR_LLD)
    add_link_options(-fuse-ld=lld)
  endif()
endif()

# One compiler takes five sources of this target: half the time where sources are wiring around headers of others. Names in
# unnamed namespaces then differ within the target. Not for sources full of Eigen's products (filter, calibration,
# smoother): twice the memory, and little time.
function(ear_compile_together target)
  if(EAR_QUICK_BUILD)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 5)
    # Classes of one source may hold what is in its unnamed namespace; g++ takes the source for a header here.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
  endif()
endfunction()
