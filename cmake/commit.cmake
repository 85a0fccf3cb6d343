# Writes OUTPUT, a C++ file with the commit of the sources in ROOT, if it would change:
# cmake -DROOT=.. -DOUTPUT=.. -P commit.cmake
find_program(git git)
set(commit "")
if(git AND EXISTS ${ROOT}/.git)
  execute_process(COMMAND ${git} describe --always --dirty=-changed --abbrev=12 --exclude=* WORKING_DIRECTORY ${ROOT}
                  OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(NOT commit)
  set(commit "unknown")  # sources without their history
endif()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#include \"tools/version.h\"

namespace ear::tools {

std::string commit() { return \"${commit}\"; }

}  // namespace ear::tools
")
