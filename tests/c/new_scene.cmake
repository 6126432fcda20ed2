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
if(NOT said MATCHES "its leaf is [^\n]*first.obj; editors complete its keys by scene.schema.json")
  message(FATAL_ERROR "not all files are named: ${said}")
endif()
run(0 run "${OUT}/first.toml" --frames 60)
# Between what nobody sees and what no leaf does, and nothing to be changed.
if(NOT said MATCHES "moved: up to 0\\.0[0-9]+ m, [1-9][0-9]* %" OR NOT said MATCHES "certified: about [0-9.]+ % of the largest displacement off" OR said MATCHES "try:")
  message(FATAL_ERROR "the first scene does not move as a leaf does:\n${said}")
endif()
# A leaf that is pulled taut and let go, by small steps: its stretch is 200 times the energy of its swings, and not to be seen in them. One step that
# takes it for resolved threw the leaf over 1.5 times its size, 5 times as far as it had been pulled. The full shell comes 1.3 times as far.
run(0 simulate "${OUT}/first.obj" --pin 0,4,10-20 --handle "high-x:0,0,0.03@1:free@1.5" --frequency 4 --damping-ratio 0.05 --step 0.00208333333
    --duration 1.7 --method polynomial-shell --no-certify)
if(NOT said MATCHES "moved: up to [0-9.]+ m, [1-4][0-9] % of its size")
  message(FATAL_ERROR "a leaf that is let go flies off:\n${said}")
endif()

# While it is led it is 1.4 % off, by a run of the full shell with steps of 1/960 s. A frame is judged with its own handles: with those of the last
# frame it was told to be 43 % off.
run(0 simulate "${OUT}/first.obj" --pin 0,4,10-20 --handle "high-x:0,0,0.03@1" --frequency 4 --duration 1.4)
if(NOT said MATCHES "auto: polynomial-shell" OR NOT said MATCHES "certified: about [0-4](\\.[0-9]+)? % of the largest displacement off")
  message(FATAL_ERROR "a leaf that is led is not told to be near the full shell:\n${said}")
endif()

run(1 new-scene "${OUT}/first.toml")
if(NOT said MATCHES "it is there already")
  message(FATAL_ERROR "an existing scene is not refused: ${said}")
endif()

file(READ "${OUT}/first.toml" scene)
foreach(line IN ITEMS "[wind]" "velocity" "gust" "[[handle]]" "side" "release" "[[handle.key]]" "time" "offset" "[[collider]]" "kind = \"sphere\""
             "radius" "position" "friction" "[[material.crease]]" "box = [0.049" "factor")
  string(REPLACE "# ${line}" "${line}" scene "${scene}")
endforeach()
file(WRITE "${OUT}/more.toml" "${scene}")
run(0 run "${OUT}/more.toml" --frames 70 --method polynomial-shell --no-certify)
if(NOT said MATCHES "steps with a handle held +240\n")
  message(FATAL_ERROR "the handle is not led:\n${said}")
endif()
if(NOT said MATCHES "creased edges +10\n +factor of their stiffness +0.2\n +with a rest angle +0\n")
  message(FATAL_ERROR "the table does not tell of the crease across the leaf:\n${said}")
endif()
if(NOT said MATCHES "touched: [1-9]")
  message(FATAL_ERROR "the leaf does not touch the collider:\n${said}")
endif()

# An older schema is replaced, a file of that name which is none is not.
file(READ "${OUT}/scene.schema.json" schema)
file(WRITE "${OUT}/scene.schema.json" "{\"title\": \"Scene of shellwarp\"}")
run(0 new-scene "${OUT}/later.toml")
file(READ "${OUT}/scene.schema.json" later)
if(NOT later STREQUAL schema)
  message(FATAL_ERROR "an older schema is not replaced")
endif()
file(WRITE "${OUT}/scene.schema.json" "mine")
run(1 new-scene "${OUT}/last.toml")
if(EXISTS "${OUT}/last.toml" OR NOT said MATCHES "scene.schema.json: it is there already")
  message(FATAL_ERROR "another's scene.schema.json is not refused: ${said}")
endif()
file(REMOVE "${OUT}/scene.schema.json")

run(0 new-scene "${OUT}/own.toml" --mesh "${MESH}")
run(0 run "${OUT}/own.toml" --frames 10 --method warp --no-certify)
# A mesh of centimetres, and one with groups.
file(COPY "${HAT}" DESTINATION "${OUT}")
run(0 new-scene "${OUT}/hat.toml" --mesh "${OUT}/character_hat.obj")
file(READ "${OUT}/hat.toml" hat)
file(READ "${OUT}/own.toml" own)
if(NOT hat MATCHES "\nscale = 0.01 +# 0.01 makes" OR NOT own MATCHES "\nscale = 1.0 +# 0.01 makes" OR NOT own MATCHES "\n# group = \"root\" +# of lines")
  message(FATAL_ERROR "the scene of a hat of 47 cm is not in centimetres, or that of a mesh with groups names none of them:\n${hat}\n${own}")
endif()
# With y up a hat stands, though it is longer from front to back, and hangs from its top.
file(REMOVE "${OUT}/hat_y.toml")
run(0 new-scene "${OUT}/hat_y.toml" --mesh "${OUT}/character_hat.obj" --up y)
file(READ "${OUT}/hat_y.toml" hat_y)
if(NOT hat_y MATCHES "\nside = \"high-y\"")
  message(FATAL_ERROR "a hat with y up is not held at its top:\n${hat_y}")
endif()
run(0 run "${OUT}/hat.toml" --frames 2 --method warp --no-certify)
run(1 new-scene "${OUT}/scene.txt")
