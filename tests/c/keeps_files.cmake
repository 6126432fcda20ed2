# A run that ends early leaves the folder as it was: an earlier file untouched, and no other beside it.
#
#   cmake -DFOLDER=dir -DNAME=file "-DARGUMENTS=program;a;b" -DEXIT=130 -DSTDERR=regex -P keeps_files.cmake
file(REMOVE_RECURSE "${FOLDER}")
file(WRITE "${FOLDER}/${NAME}" "an earlier run")
execute_process(COMMAND ${ARGUMENTS} RESULT_VARIABLE exit OUTPUT_VARIABLE stdout ERROR_VARIABLE stderr)
message("${stdout}${stderr}")
if(NOT "${exit}" STREQUAL "${EXIT}")
  message(FATAL_ERROR "exit status is ${exit}, expected ${EXIT}")
endif()
if(NOT "${stderr}" MATCHES "${STDERR}")
  message(FATAL_ERROR "stderr does not match: ${STDERR}")
endif()
file(GLOB files RELATIVE "${FOLDER}" "${FOLDER}/*" "${FOLDER}/.*")
file(READ "${FOLDER}/${NAME}" contents)
if(NOT files STREQUAL NAME OR NOT contents STREQUAL "an earlier run")
  message(FATAL_ERROR "the folder holds ${files}; ${NAME} begins with '${contents}'")
endif()
