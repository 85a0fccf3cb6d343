# Writes OUTPUT, a C++ file with a hash of the estimator's sources and one of the simulator's, for the caches of
# `ear experiments`: cmake -DROOT=.. -DOUTPUT=.. -DTOOLS=.. -P source_hashes.cmake
# TOOLS names compiler, flags and libraries: the same sources built otherwise may give other last digits.

# Files, and folders below ROOT with all their sources -> `result`: a hash of their names and contents.
function(hash_sources result)
  set(text "${TOOLS}\n")
  foreach(folder ${ARGN})
    file(GLOB_RECURSE files RELATIVE ${ROOT} ${ROOT}/${folder}/*.h ${ROOT}/${folder}/*.cpp)
    if(EXISTS ${ROOT}/${folder} AND NOT IS_DIRECTORY ${ROOT}/${folder})
      set(files ${folder})
    endif()
    list(SORT files)
    foreach(file ${files})
      file(SHA256 ${ROOT}/${file} hash)
      string(APPEND text "${file} ${hash}\n")
    endforeach()
  endforeach()
  string(SHA256 hash "${text}")
  string(SUBSTRING ${hash} 0 16 hash)
  set(${result} ${hash} PARENT_SCOPE)
endfunction()

hash_sources(estimator include filter smoother frontend src tools/evaluation tools/experiments tools/paper/measure
             tools/estimators.h tools/estimators.cpp tools/replay.cpp tools/processor_time.h)
hash_sources(simulator include tools/simulator)
file(WRITE ${OUTPUT} "#include \"tools/paper/source_hashes.h\"\n
namespace ear::paper {\n
std::string estimator_sources() { return \"${estimator}\"; }\n
std::string simulator_sources() { return \"${simulator}\"; }\n
}  // namespace ear::paper\n")
