# `new-scene` writes a scene that runs, as it is and with its handle, wind and collider; and one of a mesh of the user's own.
#
#   cmake -DPROGRAM=… -DMESH=… -DOUT=… -P new_scene.cmake
file(REMOVE_RECURSE "${OUT}")
file(MAKE_DIRECTORY "${OUT}")

function(run exit)
  execute_process(COMMAND "${PROGRAM}" ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE stdout ERROR_VARIABLE stderr)
  if(NOT result EQUAL exit)
    message(FATAL_ERROR "${ARGN}: exit status ${result}, expected ${exit}:\n${stdout}${stderr}")
  endif()
  set(said "${stdout}${stderr}" PARENT_SCOPE)
endfunction()

run(0 new-scene "${OUT}/first.toml")
run(0 run "${OUT}/first.toml" --frames 60)
# Between what nobody sees and what no leaf does, and nothing to be changed.
if(NOT said MATCHES "moved: up to 0\\.0[0-9]+ m, [1-9][0-9]* %" OR NOT said MATCHES "certified: the last frame is about [0-9.]+ %" OR said MATCHES "try:")
  message(FATAL_ERROR "the first scene does not move as a leaf does:\n${said}")
endif()
run(1 new-scene "${OUT}/first.toml")
if(NOT said MATCHES "it is there already")
  message(FATAL_ERROR "an existing scene is not refused: ${said}")
endif()

file(READ "${OUT}/first.toml" scene)
foreach(line IN ITEMS "[wind]" "velocity" "[[handle]]" "side" "release" "[[handle.key]]" "time" "offset" "[[collider]]" "kind = \"sphere\""
             "radius" "position" "friction")
  string(REPLACE "# ${line}" "${line}" scene "${scene}")
endforeach()
file(WRITE "${OUT}/more.toml" "${scene}")
run(0 run "${OUT}/more.toml" --frames 70 --method polynomial-shell --no-certify)
if(NOT said MATCHES "steps with a handle held +60\n")
  message(FATAL_ERROR "the handle is not led:\n${said}")
endif()
if(NOT said MATCHES "touched: [1-9]")
  message(FATAL_ERROR "the leaf does not touch the collider:\n${said}")
endif()

run(0 new-scene "${OUT}/own.toml" --mesh "${MESH}")
run(0 run "${OUT}/own.toml" --frames 10 --method warp --no-certify)
run(1 new-scene "${OUT}/scene.txt")
