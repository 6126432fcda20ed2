# Lays the stand-in for Houdini's kit out as an installation, names it by HFS, packs the package as a user would, and cooks
# with what is in it.
# The package below has the functions of the HoudiniConfig.cmake of Houdini 18 with the arguments that the SOP's build gives.
#   SOURCE, WORK, LIBRARY (libshellwarp), LOADER (load_alone), FAKE (the stand-in's library), TEST (houdini_sop_test), PAGE, GENERATOR, PYTHON;
#   TREE: where CMake begins instead of SOURCE, such as the plug-ins' sources in an archive; TEST is then not run
file(REMOVE_RECURSE "${WORK}")
if(NOT TREE)
  set(TREE "${SOURCE}")
endif()
set(hfs "${WORK}/hfs")
file(COPY "${SOURCE}/tests/hosts/houdini/" DESTINATION "${hfs}/toolkit/include" PATTERN "*.cpp" EXCLUDE
     PATTERN "SOP_ShellWarp.proto.h" EXCLUDE)
file(WRITE "${hfs}/toolkit/cmake/HoudiniConfig.cmake" "
set(Houdini_VERSION 20.5.0)
add_library(Houdini INTERFACE)
target_include_directories(Houdini SYSTEM INTERFACE \"${hfs}/toolkit/include\")
target_link_libraries(Houdini INTERFACE \"${FAKE}\")
function(houdini_generate_proto_headers)
  cmake_parse_arguments(H_PROTO \"\" \"OUTPUT_VAR;API\" \"FILES\" \${ARGN})
  if(NOT H_PROTO_FILES STREQUAL SOP_ShellWarp.cpp)
    message(FATAL_ERROR \"no header is generated for \${H_PROTO_FILES}\")
  endif()
  file(COPY \"${SOURCE}/tests/hosts/houdini/SOP_ShellWarp.proto.h\" DESTINATION \"\${CMAKE_CURRENT_BINARY_DIR}\")
endfunction()
function(houdini_configure_target target_name)
  cmake_parse_arguments(H_OUTPUT \"\" \"INSTDIR;LIB_PREFIX\" \"\" \${ARGN})
  set_target_properties(\${target_name} PROPERTIES PREFIX \"\" LIBRARY_OUTPUT_DIRECTORY_RELEASE \"\${H_OUTPUT_INSTDIR}\")
endfunction()
")

include("${CMAKE_CURRENT_LIST_DIR}/plugin_tree.cmake")
set(configure "${CMAKE_COMMAND}" -S "${TREE}" -B "${WORK}/build" -G "${GENERATOR}" -DCMAKE_BUILD_TYPE=Release
    "-DSHELLWARP_PREBUILT_LIBRARY=${LIBRARY}" -DSHELLWARP_BUILD_CLI=OFF -DSHELLWARP_BUILD_TESTS=OFF)

# A folder that is no Houdini is named, when configuring and when the package is asked for.
run_step(${configure} "-DHFS=${WORK}")
must_match("${output}" "Houdini: HFS is [^ ]*, without toolkit/cmake/HoudiniConfig.cmake")
refused_step("HFS is [^ ]*, without toolkit" "${CMAKE_COMMAND}" --build "${WORK}/build" --target shellwarp_houdini_tree)

# And one of which a part is there: the part that is missing is named.
file(RENAME "${hfs}/toolkit/cmake" "${hfs}/toolkit/elsewhere")
run_step(${configure} "-DHFS=${hfs}")
string(REPLACE "\n" " " output "${output}")
must_match("${output}" "without toolkit/cmake/HoudiniConfig.cmake; its headers are there")
file(RENAME "${hfs}/toolkit/elsewhere" "${hfs}/toolkit/cmake")
file(RENAME "${hfs}/toolkit/include/SOP" "${hfs}/toolkit/include/elsewhere")
run_step(${configure} "-DHFS=${hfs}")
string(REPLACE "\n" " " output "${output}")
must_match("${output}" "without toolkit/include/SOP/SOP_NodeVerb.h")
file(RENAME "${hfs}/toolkit/include/elsewhere" "${hfs}/toolkit/include/SOP")

run_step(${configure} "-DHFS=${hfs}")
must_match("${output}" "Houdini 20.5.0 in ")
run_step("${CMAKE_COMMAND}" --build "${WORK}/build" --target shellwarp_houdini_tree)
unpack_elsewhere(houdini shellwarp-${VERSION}-houdini20.5-linux)
file(REMOVE_RECURSE "${WORK}/build")
same_files("shellwarp.json;shellwarp/config/Icons/SOP_shellwarp.svg;shellwarp/dso/SOP_ShellWarp.so;\
shellwarp/dso/libshellwarp.so.0;shellwarp/help/nodes/sop/shellwarp.txt;shellwarp/licences/LICENSE-APACHE;shellwarp/licences/LICENSE-MIT;\
shellwarp/licences/THIRD_PARTY.md")

# Where Houdini looks: the folder beside the package file joins HOUDINI_PATH, in this Houdini alone.
file(READ "${UNPACKED}/shellwarp.json" package)
string(JSON path GET "${package}" hpath)
string(JSON enable GET "${package}" enable)
if(NOT path STREQUAL "$HOUDINI_PACKAGE_PATH/shellwarp")
  message(FATAL_ERROR "hpath is ${path}")
endif()
if(NOT enable STREQUAL "houdini_os == 'linux' and houdini_version >= '20.5' and houdini_version < '20.6'")
  message(FATAL_ERROR "enable is ${enable}")
endif()
set(dso "${UNPACKED}/shellwarp/dso")
run_step("${LOADER}" "${dso}/SOP_ShellWarp.so" "${dso}/" "${FAKE}")
if(TEST)
  run_step("${TEST}" "${dso}/SOP_ShellWarp.so" "${PAGE}")
endif()
