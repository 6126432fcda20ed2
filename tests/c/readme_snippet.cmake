# Compiles and runs the first ```c block of README.md, which must be a whole program. Finding none is a failure.
#
#   cmake -DREADME=… -DCC=… -DINCLUDE=dir -DLIBRARY_DIRECTORY=dir -DOUT=dir -P readme_snippet.cmake
if(NOT EXISTS "${README}")
  message(FATAL_ERROR "there is no ${README}")
endif()
file(READ "${README}" text)
set(fence "\n```c\n")
string(LENGTH "${fence}" fence_length)
string(FIND "${text}" "${fence}" start)
if(start EQUAL -1)
  message(FATAL_ERROR "${README} has no \`\`\`c block")
endif()
math(EXPR start "${start} + ${fence_length}")
string(SUBSTRING "${text}" ${start} -1 text)
string(FIND "${text}" "\n```" length)
if(length EQUAL -1)
  message(FATAL_ERROR "the \`\`\`c block of ${README} does not end")
endif()
string(SUBSTRING "${text}" 0 ${length} snippet)

file(WRITE "${OUT}/snippet.c" "${snippet}\n")
execute_process(
  COMMAND "${CC}" -std=c99 -Wall -Wextra -Wpedantic -Werror "-I${INCLUDE}" "${OUT}/snippet.c" -o "${OUT}/snippet"
          "-L${LIBRARY_DIRECTORY}" "-Wl,-rpath,${LIBRARY_DIRECTORY}" -lshellwarp -lm
  RESULT_VARIABLE exit)
if(NOT exit EQUAL 0)
  message(FATAL_ERROR "the first \`\`\`c block of ${README} does not compile")
endif()
execute_process(COMMAND "${OUT}/snippet" RESULT_VARIABLE exit OUTPUT_VARIABLE stdout ERROR_VARIABLE stderr)
message("${stdout}${stderr}")
if(NOT exit EQUAL 0)
  message(FATAL_ERROR "the first \`\`\`c block of ${README} compiles, but exits with ${exit}")
endif()
