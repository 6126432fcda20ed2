# A scene whose mesh has the name of an output is refused before the work, and the mesh stays; elsewhere it runs.
#
#   cmake -DPROGRAM=… -DMESH=file.obj -DOUT=dir -P input_is_no_output.cmake
file(REMOVE_RECURSE "${OUT}")
file(MAKE_DIRECTORY "${OUT}/linked")
file(COPY_FILE "${MESH}" "${OUT}/a_rest.obj")
file(WRITE "${OUT}/a.toml" "mesh = 'a_rest.obj'\n[simulation]\nduration = 0.1\nmodes = 2\n")
file(CREATE_LINK "${OUT}/a_rest.obj" "${OUT}/linked/a.pc2")
foreach(folder IN ITEMS . linked other)
  execute_process(COMMAND "${PROGRAM}" run a.toml --out ${folder} --quiet WORKING_DIRECTORY "${OUT}" RESULT_VARIABLE exit
                  ERROR_VARIABLE stderr)
  if(folder STREQUAL "other")
    if(NOT exit EQUAL 0)
      message(FATAL_ERROR "exit status ${exit}: ${stderr}")
    endif()
  elseif(NOT exit EQUAL 1 OR NOT stderr MATCHES "it is the input a_rest.obj; choose another folder")
    message(FATAL_ERROR "${folder}: exit status ${exit}: ${stderr}")
  endif()
endforeach()
file(SHA256 "${MESH}" before)
file(SHA256 "${OUT}/a_rest.obj" after)
if(NOT before STREQUAL after)
  message(FATAL_ERROR "the mesh was changed")
endif()
