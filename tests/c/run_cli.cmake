# Runs a program and judges its exit status and its words.
#
#   cmake "-DPROGRAM=[emulator;]…" "-DARGUMENTS=a;b" -DEXIT=1 [-DSTDOUT=regex] [-DSTDERR=regex] [-DWRITES=file;file] -P run_cli.cmake
#
# Files in WRITES are removed first and must be there, and not empty, afterwards.
foreach(file IN LISTS WRITES)
  file(REMOVE "${file}")
endforeach()

execute_process(COMMAND ${PROGRAM} ${ARGUMENTS} RESULT_VARIABLE exit OUTPUT_VARIABLE stdout ERROR_VARIABLE stderr)
message("${stdout}${stderr}")

if(NOT "${exit}" STREQUAL "${EXIT}")
  message(FATAL_ERROR "exit status is ${exit}, expected ${EXIT}")
endif()
foreach(stream IN ITEMS stdout stderr)
  string(TOUPPER ${stream} expected)
  if(DEFINED ${expected} AND NOT "${${stream}}" MATCHES "${${expected}}")
    message(FATAL_ERROR "${stream} does not match: ${${expected}}")
  endif()
endforeach()
foreach(file IN LISTS WRITES)
  if(NOT EXISTS "${file}")
    message(FATAL_ERROR "was not written: ${file}")
  endif()
  file(SIZE "${file}" size)
  if(size EQUAL 0)
    message(FATAL_ERROR "is empty: ${file}")
  endif()
endforeach()
