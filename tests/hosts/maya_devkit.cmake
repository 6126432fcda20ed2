# Lays the stand-in for Maya out as a devkit, finds it by DEVKIT_LOCATION, builds the plug-in as a user would, and runs it.
#   SOURCE, WORK, LIBRARY (libshellwarp), LOADER (load_alone), FAKE (the stand-in's library), TEST (maya_node_test), PAGE (docs/guide/maya.md), GENERATOR
file(REMOVE_RECURSE "${WORK}")
set(devkit "${WORK}/devkitBase")
file(COPY "${SOURCE}/tests/hosts/maya/maya" "${SOURCE}/tests/hosts/maya/fake_maya.hpp" DESTINATION "${devkit}/include")
file(WRITE "${devkit}/include/maya/MTypes.h" "#define MAYA_API_VERSION 20240000\n")
file(MAKE_DIRECTORY "${devkit}/lib")
foreach(name IN ITEMS OpenMaya OpenMayaAnim Foundation)
  file(COPY_FILE "${FAKE}" "${devkit}/lib/lib${name}.so")
endforeach()

function(run_step)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "failed: ${ARGN}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

run_step("${CMAKE_COMMAND}" -S "${SOURCE}" -B "${WORK}/build" -G "${GENERATOR}" -DCMAKE_BUILD_TYPE=Release
         "-DDEVKIT_LOCATION=${devkit}" "-DSHELLWARP_PREBUILT_LIBRARY=${LIBRARY}" -DSHELLWARP_BUILD_CLI=OFF
         -DSHELLWARP_BUILD_TESTS=OFF)
if(NOT output MATCHES "Maya 20240000 in ")
  message(FATAL_ERROR "the devkit was not found:\n${output}")
endif()
run_step("${CMAKE_COMMAND}" --build "${WORK}/build" --target shellwarp_maya)

# Copied elsewhere with its library beside it, and the build gone, as docs say to install it.
file(COPY "${WORK}/build/maya/plug-ins/shellWarp.so" "${WORK}/build/lib/libshellwarp.so.0" DESTINATION "${WORK}/moved/plug-ins")
file(REMOVE_RECURSE "${WORK}/build")
run_step("${LOADER}" "${WORK}/moved/plug-ins/shellWarp.so" "${WORK}/moved/plug-ins/" "${FAKE}")
run_step("${TEST}" "${WORK}/moved/plug-ins/shellWarp.so" "${PAGE}")
