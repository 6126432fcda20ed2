# shellwarp_python_test(NAME SET set NEEDS packages… [LABEL label] [ENVIRONMENT …]
#                       [WRITES file EXPECTED file] ARGUMENTS …)
#
# A test in Python, with the package `shellwarp` of this project and the library just built. See RunPython.cmake.
set(SHELLWARP_PYTHON "" CACHE FILEPATH "A Python to prefer for the tests; empty = .venv's, then python3")

function(shellwarp_python_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "SET;LABEL;WRITES;EXPECTED" "NEEDS;ENVIRONMENT;ARGUMENTS")
  if(NOT arg_LABEL)
    set(arg_LABEL python)
  endif()
  set(venv "${PROJECT_SOURCE_DIR}/.venv")
  set(pythons "${venv}/bin/python" python3)
  if(arg_SET STREQUAL blender)
    set(pythons "${venv}/blender/bin/python" python3)
  endif()
  if(SHELLWARP_PYTHON)
    list(PREPEND pythons "${SHELLWARP_PYTHON}")
  endif()
  add_test(NAME ${name}
    COMMAND "${CMAKE_COMMAND}" "-DPYTHONS=${pythons}" "-DNEEDS=${arg_NEEDS}" -DSET=${arg_SET} "-DARGUMENTS=${arg_ARGUMENTS}"
            "-DWRITES=${arg_WRITES}" "-DEXPECTED=${arg_EXPECTED}" -P "${PROJECT_SOURCE_DIR}/cmake/RunPython.cmake")
  set_tests_properties(${name} PROPERTIES LABELS ${arg_LABEL} SKIP_REGULAR_EXPRESSION "^skipped: "
    ENVIRONMENT "SHELLWARP_LIBRARY=$<TARGET_FILE:shellwarp::shellwarp>;PYTHONPATH=${PROJECT_SOURCE_DIR}/host_examples/python;PYTHONDONTWRITEBYTECODE=1;${arg_ENVIRONMENT}")
endfunction()
