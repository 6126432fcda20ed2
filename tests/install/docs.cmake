# Builds and runs the first program of docs/guide/cmake.md as it stands there, against an installation.
#
#   cmake -DPAGE=docs/guide/cmake.md -DPREFIX=dir -DOUT=dir -DCC=… -DCXX=… -P docs.cmake
file(READ "${PAGE}" text)
string(REPLACE ";" "@semicolon@" text "${text}") # CMake's lists would split there
file(REMOVE_RECURSE "${OUT}")
foreach(block IN ITEMS "cmake CMakeLists.txt" "cpp first.cpp")
  string(REPLACE " " ";" block "${block}")
  list(GET block 0 language)
  list(GET block 1 name)
  string(FIND "${text}" "\n```${language}\n" start)
  if(start EQUAL -1)
    message(FATAL_ERROR "${PAGE} has no ${language} block")
  endif()
  string(SUBSTRING "${text}" ${start} -1 rest)
  string(REGEX REPLACE "^\n```[a-z]+\n" "" rest "${rest}")
  string(FIND "${rest}" "\n```" length)
  string(SUBSTRING "${rest}" 0 ${length} program)
  string(REPLACE "@semicolon@" ";" program "${program}")
  file(WRITE "${OUT}/${name}" "${program}\n")
endforeach()
execute_process(COMMAND "${CMAKE_COMMAND}" -B build "-DCMAKE_PREFIX_PATH=${PREFIX}" "-DCMAKE_CXX_COMPILER=${CXX}"
                        "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror"
                WORKING_DIRECTORY "${OUT}" COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND "${CMAKE_COMMAND}" --build build WORKING_DIRECTORY "${OUT}" COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND build/first WORKING_DIRECTORY "${OUT}" OUTPUT_VARIABLE shown COMMAND_ERROR_IS_FATAL ANY)
message("${shown}")
if(NOT shown MATCHES "the far edge is at z = -0\\.[0-9]*[1-9]")
  message(FATAL_ERROR "the edge does not hang: ${shown}")
endif()
