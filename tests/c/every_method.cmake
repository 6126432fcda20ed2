# The strip falls by every method that the program knows, whatever these are, or the program says why its model lacks one: PROGRAM,
# MESH. The names are those that the program lists where it is given none of them.
execute_process(COMMAND ${PROGRAM} simulate ${MESH} --method ? RESULT_VARIABLE status ERROR_VARIABLE complaint)
if(NOT status EQUAL 2 OR NOT complaint MATCHES "not in {([a-z,-]+)}")
  message(FATAL_ERROR "an unknown method: exit status ${status}, ${complaint}")
endif()
string(REPLACE "," ";" methods "${CMAKE_MATCH_1}")
set(moved 0)
foreach(method IN LISTS methods)
  # The explicit shell bears no longer steps.
  execute_process(COMMAND ${PROGRAM} simulate ${MESH} --clamp-box 0 -1 -1 0 1 1 --gravity 0 0 -1 --damping-ratio 0.1 --method ${method}
                          --step 1e-4 --frames 100
    RESULT_VARIABLE status OUTPUT_VARIABLE table ERROR_VARIABLE complaint)
  if(status EQUAL 1 AND complaint MATCHES "not supported: ")
    message("${method}: ${complaint}")
    continue()
  endif()
  # By 1/2 g t^2 = 5e-5 in this time.
  if(NOT status EQUAL 0 OR NOT table MATCHES "method +${method}(: [a-z-]+)?\n +largest displacement +([1-9][0-9.]*e-05) ")
    message(FATAL_ERROR "${method}: exit status ${status}, ${complaint}${table}")
  endif()
  message("${method}: moved by ${CMAKE_MATCH_2}")
  math(EXPR moved "${moved} + 1")
endforeach()
if(moved LESS 8)
  message(FATAL_ERROR "only ${moved} methods move: ${methods}")
endif()
