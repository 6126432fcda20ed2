# Runs a Python test by the first Python that has the packages it needs; where none has, one line that starts with
# "skipped: " says so, and the test counts as skipped.
#
#   cmake "-DPYTHONS=a;b" "-DNEEDS=numpy;cffi" -DSET=name "-DARGUMENTS=…" -P RunPython.cmake
#
# SET is the argument of cmake/bootstrap.sh that installs what is needed.
list(TRANSFORM NEEDS PREPEND "import " OUTPUT_VARIABLE imports)
list(JOIN imports "\n" imports)
foreach(python IN LISTS PYTHONS)
  execute_process(COMMAND "${python}" -c "${imports}" RESULT_VARIABLE exit OUTPUT_QUIET ERROR_QUIET)
  if(exit EQUAL 0)
    execute_process(COMMAND "${python}" ${ARGUMENTS} RESULT_VARIABLE exit)
    if(NOT exit EQUAL 0)
      message(FATAL_ERROR "${python} exits with ${exit}")
    endif()
    return()
  endif()
endforeach()
list(JOIN NEEDS ", " needs)
message("skipped: no Python with ${needs} (sh cmake/bootstrap.sh ${SET})")
