# Runs a Python test by the first Python that has the packages it needs; where none has, one line that starts with
# "skipped: " says so, and the test counts as skipped.
#
#   cmake "-DPYTHONS=a;b" "-DNEEDS=numpy;cffi" -DSET=name "-DARGUMENTS=…" -P RunPython.cmake
#
# SET is the argument of cmake/bootstrap.sh that installs what is needed. With WRITES and EXPECTED, the file that the test
# writes must be equal to the other.
if(WRITES)
  file(REMOVE "${WRITES}")
endif()
list(TRANSFORM NEEDS PREPEND "import " OUTPUT_VARIABLE imports)
list(JOIN imports "\n" imports)
foreach(python IN LISTS PYTHONS)
  execute_process(COMMAND "${python}" -c "${imports}" RESULT_VARIABLE exit OUTPUT_QUIET ERROR_QUIET)
  if(exit EQUAL 0)
    execute_process(COMMAND "${python}" ${ARGUMENTS} RESULT_VARIABLE exit)
    if(NOT exit EQUAL 0)
      message(FATAL_ERROR "${python} exits with ${exit}")
    endif()
    if(WRITES)
      execute_process(COMMAND "${CMAKE_COMMAND}" -E compare_files "${WRITES}" "${EXPECTED}" COMMAND_ERROR_IS_FATAL ANY)
    endif()
    return()
  endif()
endforeach()
list(JOIN NEEDS ", " needs)
message("skipped: no Python with ${needs} (sh cmake/bootstrap.sh ${SET})")
