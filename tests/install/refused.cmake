# find_package refuses what the installation cannot give, and says why.
#
#   cmake -DPREFIX=dir -DSOURCES=dir -DOUT=dir -DCC=… -DCXX=… -P refused.cmake
function(must_fail text)
  file(REMOVE_RECURSE "${OUT}")
  execute_process(COMMAND "${CMAKE_COMMAND}" -S "${CMAKE_CURRENT_LIST_DIR}/consumer" -B "${OUT}" "-DCMAKE_PREFIX_PATH=${PREFIX}"
                          "-DSOURCES=${SOURCES}" "-DCMAKE_C_COMPILER=${CC}" "-DCMAKE_CXX_COMPILER=${CXX}" ${ARGN}
                  RESULT_VARIABLE exit OUTPUT_QUIET ERROR_VARIABLE message)
  string(REGEX REPLACE "[ \n]+" " " message "${message}")
  if(exit EQUAL 0 OR NOT message MATCHES "${text}")
    message(FATAL_ERROR "${ARGN}: exit ${exit}, expected “${text}”:\n${message}")
  endif()
endfunction()

must_fail("compatible with requested version \"0.99\"" -DVERSION=0.99)
must_fail("compatible with requested version \"1.0\"" -DVERSION=1.0)
must_fail("has no component 'gpu'" -DCOMPONENT=gpu)
