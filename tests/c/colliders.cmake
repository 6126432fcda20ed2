# Shells that fall on colliders of a scene lie at their height in the file of the last frame: on a plane, on a closed mesh named
# relative to the scene, and on a box that rises under them. Every shell of a file touches all colliders.
#
#   cmake -DPROGRAM=… -DMESH=strip.off -DOUT=dir -P colliders.cmake
file(REMOVE_RECURSE "${OUT}")
file(MAKE_DIRECTORY "${OUT}/solids")
file(COPY_FILE "${MESH}" "${OUT}/strip.off")
file(WRITE "${OUT}/solids/cube.off" "OFF\n8 6 0\n-3 -3 -3\n3 -3 -3\n3 3 -3\n-3 3 -3\n-3 -3 3\n3 -3 3\n3 3 3\n-3 3 3\n"
     "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n")
set(simulation "obj_times = [2]\n[simulation]\nduration = 2\ngravity = [0, 0, -9.8]\n")
set(damping "damping]\nratio = 0.1\n")

# Every vertex of the file lies at the height, within 2e-5 of the strip's size of 2.06: see sw_state_set_colliders.
function(judge_heights name height)
  math(EXPR low "${height} - 42")
  math(EXPR high "${height} + 42")
  file(STRINGS "${OUT}/out/${name}_frame_0060.obj" vertices REGEX "^v ")
  list(LENGTH vertices count)
  if(NOT count EQUAL 27)
    message(FATAL_ERROR "${name} has ${count} vertices")
  endif()
  foreach(vertex IN LISTS vertices)
    if(NOT vertex MATCHES "^v [^ ]+ [^ ]+ -0\\.([0-9]+)$")
      message(FATAL_ERROR "${name}: ${vertex} is not below 0")
    endif()
    string(SUBSTRING "${CMAKE_MATCH_1}000000" 0 6 digits)
    math(EXPR z "-1${digits} + 1000000")
    if(z LESS low OR z GREATER high)
      message(FATAL_ERROR "${name}: ${vertex} is not within 42 of ${height} millionths")
    endif()
  endforeach()
endfunction()

# `height` in millionths; behind all else the names of the shells that are written.
function(rests name height mesh collider)
  file(WRITE "${OUT}/${name}.toml" "${mesh}${simulation}[[collider]]\nfriction = 0.4\n${collider}")
  execute_process(COMMAND "${PROGRAM}" run "${OUT}/${name}.toml" --no-certify --out "${OUT}/out"
    RESULT_VARIABLE exit OUTPUT_VARIABLE stdout ERROR_VARIABLE stderr)
  if(NOT exit EQUAL 0 OR NOT stdout MATCHES "touched: [1-9][0-9]* contacts at most")
    message(FATAL_ERROR "${name}: exit status ${exit}: ${stdout}${stderr}")
  endif()
  foreach(shell IN ITEMS ${ARGN})
    judge_heights(${shell} ${height})
  endforeach()
  set(said "${stdout}" PARENT_SCOPE)
endfunction()

set(strip "mesh = 'strip.off'\n")
rests(plane -200000 "${strip}" "kind = 'plane'\nposition = [0, 0, -0.2]\n[${damping}" plane)
rests(mesh -200000 "${strip}" "kind = 'mesh'\nmesh = 'solids/cube.off'\nposition = [1, 0, -3.2]\n[${damping}" mesh)
file(WRITE "${OUT}/solids/ground.off" "OFF\n4 1 0\n-3 -3 0\n3 -3 0\n3 3 0\n-3 3 0\n4 0 1 2 3\n")
rests(ground -200000 "${strip}" "kind = 'mesh'\nmesh = 'solids/ground.off'\none_sided = true\nposition = [1, 0, -0.2]\n[${damping}" ground)
rests(box -100000 "${strip}" "kind = 'box'\nhalf_extents = [3, 3, 3]\nposition = [1, 0, -3.2]
                             key = [{ time = 1, offset = [0, 0, 0.1] }]\n[${damping}" box)
rests(both -200000 "" "kind = 'plane'\nposition = [0, 0, -0.2]\n[[shell]]\nname = 'a'\n${strip}[shell.${damping}[[shell]]\nname = 'b'\n${strip}[shell.${damping}"
      both_a both_b)
if(NOT said MATCHES "touched: [1-9].*touched: [1-9]")
  message(FATAL_ERROR "not both shells touch the plane:\n${said}")
endif()
