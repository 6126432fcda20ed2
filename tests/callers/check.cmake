# Runs a caller and compares the positions it writes with the C program's, byte by byte.
#
#   cmake "-DPROGRAM=…;ARGUMENTS" -DOUT=file -DEXPECTED=file -P check.cmake
file(REMOVE "${OUT}")
execute_process(COMMAND ${PROGRAM} "${OUT}" COMMAND_ERROR_IS_FATAL ANY)
file(SIZE "${EXPECTED}" size)
if(NOT size EQUAL 1488) # 124 vertices of three float32
  message(FATAL_ERROR "${EXPECTED} has ${size} bytes")
endif()
execute_process(COMMAND "${CMAKE_COMMAND}" -E compare_files "${OUT}" "${EXPECTED}" RESULT_VARIABLE exit)
if(NOT exit EQUAL 0)
  message(FATAL_ERROR "${OUT} is not what the C program writes")
endif()
