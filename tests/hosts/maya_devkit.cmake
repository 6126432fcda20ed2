# Lays the stand-in for Maya out as a devkit, finds it by DEVKIT_LOCATION, packs the module as a user would, and runs what is in it.
#   SOURCE, WORK, LIBRARY (libshellwarp), LOADER (load_alone), FAKE (the stand-in's library), TEST (maya_node_test), PAGE (docs/guide/maya.md), GENERATOR, PYTHON;
#   TREE: where CMake begins instead of SOURCE, such as the plug-ins' sources in an archive; TEST is then not run
file(REMOVE_RECURSE "${WORK}")
if(NOT TREE)
  set(TREE "${SOURCE}")
endif()
set(devkit "${WORK}/devkitBase")
file(COPY "${SOURCE}/tests/hosts/maya/maya" "${SOURCE}/tests/hosts/maya/fake_maya.hpp" DESTINATION "${devkit}/include")
file(MAKE_DIRECTORY "${devkit}/lib")
foreach(name IN ITEMS OpenMaya OpenMayaAnim Foundation)
  file(COPY_FILE "${FAKE}" "${devkit}/lib/lib${name}.so")
endforeach()

include("${CMAKE_CURRENT_LIST_DIR}/plugin_tree.cmake")
set(configure "${CMAKE_COMMAND}" -S "${TREE}" -B "${WORK}/build" -G "${GENERATOR}" -DCMAKE_BUILD_TYPE=Release
    "-DDEVKIT_LOCATION=${devkit}" "-DSHELLWARP_PREBUILT_LIBRARY=${LIBRARY}" -DSHELLWARP_BUILD_CLI=OFF -DSHELLWARP_BUILD_TESTS=OFF)

# A devkit that lacks a library is told from none at all, when configuring and when the module is asked for.
file(RENAME "${devkit}/lib/libOpenMayaAnim.so" "${devkit}/lib/elsewhere")
run_step(${configure})
string(REPLACE "\n" " " output "${output}")
must_match("${output}" "Maya: headers in [^ ]*/devkitBase/include, but without the libraries OpenMayaAnim; looked in [^ ]*/devkitBase")
refused_step("without the libraries OpenMayaAnim" "${CMAKE_COMMAND}" --build "${WORK}/build" --target shellwarp_maya_tree)
file(RENAME "${devkit}/lib/elsewhere" "${devkit}/lib/libOpenMayaAnim.so")

run_step(${configure})
must_match("${output}" "Maya 20240000 in ")
run_step("${CMAKE_COMMAND}" --build "${WORK}/build" --target shellwarp_maya_tree)
unpack_elsewhere(maya shellwarp-${VERSION}-maya2024-linux)
file(REMOVE_RECURSE "${WORK}/build")
same_files("shellWarp.mod;shellWarp/icons/out_shellWarp.png;shellWarp/icons/shellWarp.png;\
shellWarp/licences/LICENSE-APACHE;shellWarp/licences/LICENSE-MIT;shellWarp/licences/THIRD_PARTY.md;\
shellWarp/plug-ins/libshellwarp.so.0;shellWarp/plug-ins/shellWarp.so;shellWarp/scripts/AEshellWarpTemplate.mel;\
shellWarp/scripts/shellWarpCreateUI.mel;shellWarp/scripts/shellWarpDeleteUI.mel;shellWarp/scripts/shellwarp_maya.py")

# Where Maya looks: the module's folder is named relative to the module file.
file(READ "${UNPACKED}/shellWarp.mod" module)
must_match("${module}" "^\\+ MAYAVERSION:2024 PLATFORM:linux shellWarp ${VERSION} shellWarp\n")
set(plugins "${UNPACKED}/shellWarp/plug-ins")
run_step("${LOADER}" "${plugins}/shellWarp.so" "${plugins}/" "${FAKE}")
if(TEST)
  run_step("${TEST}" "${plugins}/shellWarp.so" "${PAGE}" "${UNPACKED}/shellWarp/scripts")
endif()
