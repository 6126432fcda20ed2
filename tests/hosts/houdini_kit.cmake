# Lays the stand-in for Houdini's kit out as an installation, names it by HFS, builds the SOP as a user would, and cooks it.
# The package below has the functions of the HoudiniConfig.cmake of Houdini 18 with the arguments that the SOP's build gives.
#   SOURCE, WORK, LIBRARY (libshellwarp), LOADER (load_alone), FAKE (the stand-in's library), TEST (houdini_sop_test), PAGE, GENERATOR
file(REMOVE_RECURSE "${WORK}")
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

function(run_step)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "failed: ${ARGN}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

run_step("${CMAKE_COMMAND}" -S "${SOURCE}" -B "${WORK}/build" -G "${GENERATOR}" -DCMAKE_BUILD_TYPE=Release "-DHFS=${hfs}"
         "-DSHELLWARP_PREBUILT_LIBRARY=${LIBRARY}" -DSHELLWARP_BUILD_CLI=OFF -DSHELLWARP_BUILD_TESTS=OFF)
if(NOT output MATCHES "Houdini 20.5.0 in ")
  message(FATAL_ERROR "the kit was not found:\n${output}")
endif()
run_step("${CMAKE_COMMAND}" --build "${WORK}/build" --target shellwarp_houdini)

# Copied elsewhere with its library beside it, and the build gone, as docs say to install it.
file(COPY "${WORK}/build/houdini/dso/SOP_ShellWarp.so" "${WORK}/build/lib/libshellwarp.so.0" DESTINATION "${WORK}/moved/dso")
file(REMOVE_RECURSE "${WORK}/build")
run_step("${LOADER}" "${WORK}/moved/dso/SOP_ShellWarp.so" "${WORK}/moved/dso/" "${FAKE}")
run_step("${TEST}" "${WORK}/moved/dso/SOP_ShellWarp.so" "${PAGE}")
