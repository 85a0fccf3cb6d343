# Headers that most sources begin with, compiled once: with Eigen they are 0.6 to 0.8 s of each of 260 sources. No source
# may rely on them: the presets debug, asan, fuzz and tidy build without. EAR_PRECOMPILED_HEADERS turns them off.
#
# One compiled header serves all libraries, since these are compiled with the same flags; programs are not (-fPIE).
option(EAR_PRECOMPILED_HEADERS "Compile common headers once; needs more care from caches of compilers" ON)

if(EAR_PRECOMPILED_HEADERS)
  # ccache (4.0 and later) takes part only where it may disregard that such a file holds macros and a time.
  if(CMAKE_CXX_COMPILER_LAUNCHER MATCHES "(^|/)ccache$")
    set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros
                                    ${CMAKE_CXX_COMPILER_LAUNCHER})
  endif()

  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/precompiled.cpp CONTENT "// Its headers are what counts.\n")
  add_library(ear_precompiled OBJECT ${PROJECT_BINARY_DIR}/precompiled.cpp)
  target_compile_features(ear_precompiled PRIVATE cxx_std_17)
  set_target_properties(ear_precompiled PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_link_libraries(ear_precompiled PRIVATE Eigen3::Eigen)
  target_precompile_headers(ear_precompiled PRIVATE <Eigen/Cholesky> <Eigen/Core> <Eigen/Geometry> <Eigen/LU> <algorithm>
                            <array> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <optional> <stdexcept>
                            <string> <utility> <variant> <vector>)
endif()
