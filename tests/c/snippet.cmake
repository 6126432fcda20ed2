# Compiles and runs the first ```c block of a page, which must be a whole program: with every warning an error, and with the
# page's own `cc` line, run in a folder where include and build are what they are in the project's. Finding either missing
# is a failure.
#
#   cmake -DPAGE=… -DCC=… -DINCLUDE=dir -DLIBRARY_DIRECTORY=dir -DOUT=dir -P snippet.cmake
if(NOT EXISTS "${PAGE}")
  message(FATAL_ERROR "there is no ${PAGE}")
endif()
file(READ "${PAGE}" text)
set(fence "\n```c\n")
string(LENGTH "${fence}" fence_length)
string(FIND "${text}" "${fence}" start)
if(start EQUAL -1)
  message(FATAL_ERROR "${PAGE} has no \`\`\`c block")
endif()
math(EXPR start "${start} + ${fence_length}")
string(SUBSTRING "${text}" ${start} -1 text)
string(FIND "${text}" "\n```" length)
if(length EQUAL -1)
  message(FATAL_ERROR "the \`\`\`c block of ${PAGE} does not end")
endif()
string(SUBSTRING "${text}" 0 ${length} snippet)

file(WRITE "${OUT}/snippet.c" "${snippet}\n")
execute_process(
  COMMAND "${CC}" -std=c99 -Wall -Wextra -Wpedantic -Werror "-I${INCLUDE}" "${OUT}/snippet.c" -o "${OUT}/snippet"
          "-L${LIBRARY_DIRECTORY}" "-Wl,-rpath,${LIBRARY_DIRECTORY}" -lshellwarp -lm
  RESULT_VARIABLE exit)
if(NOT exit EQUAL 0)
  message(FATAL_ERROR "the first \`\`\`c block of ${PAGE} does not compile")
endif()
execute_process(COMMAND "${OUT}/snippet" RESULT_VARIABLE exit OUTPUT_VARIABLE stdout ERROR_VARIABLE stderr)
message("${stdout}${stderr}")
if(NOT exit EQUAL 0)
  message(FATAL_ERROR "the first \`\`\`c block of ${PAGE} compiles, but exits with ${exit}")
endif()

string(REGEX MATCH "\n    (cc [^\n]*example\\.c[^\n]*)\n" found "${text}")
set(line "${CMAKE_MATCH_1}")
if(NOT found)
  message(FATAL_ERROR "${PAGE} has no `cc … example.c …` line after its \`\`\`c block")
endif()
get_filename_component(build "${LIBRARY_DIRECTORY}" DIRECTORY)
file(REMOVE_RECURSE "${OUT}/as_told")
file(MAKE_DIRECTORY "${OUT}/as_told")
file(CREATE_LINK "${INCLUDE}" "${OUT}/as_told/include" SYMBOLIC)
file(CREATE_LINK "${build}" "${OUT}/as_told/build" SYMBOLIC)
file(WRITE "${OUT}/as_told/example.c" "${snippet}\n")
execute_process(COMMAND sh -c "${line} && ./a.out" WORKING_DIRECTORY "${OUT}/as_told" RESULT_VARIABLE exit)
if(NOT exit EQUAL 0)
  message(FATAL_ERROR "the line of ${PAGE} fails: ${line}")
endif()
