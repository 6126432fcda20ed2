# The tree of a plug-in that a user unpacks: the plug-in, its library beside it, licences, and what its host reads.
#
# shellwarp_plugin_tree(NAME target ROOT FOLDER PLUGINS ARCHIVE name)
#   install rules of the component NAME: the plug-in and libshellwarp in FOLDER/PLUGINS, licences in FOLDER/licences
#   the target shellwarp_NAME_tree, which puts the tree into build/NAME/trees/ARCHIVE, without debugging information
# shellwarp_no_plugin_tree(NAME reason): the same target, which says why there is no tree, and fails
#
# The rules are no part of `cmake --install` without a component: a host looks for its plug-ins elsewhere.
function(shellwarp_plugin_tree name target folder plugins archive)
  set(rule COMPONENT ${name} EXCLUDE_FROM_ALL)
  install(TARGETS ${target} LIBRARY DESTINATION "${folder}/${plugins}" ${rule} RUNTIME DESTINATION "${folder}/${plugins}" ${rule})
  install(PROGRAMS "${shellwarp_directory}/${shellwarp_load_name}" DESTINATION "${folder}/${plugins}" ${rule})
  if(CMAKE_STRIP AND UNIX)
    install(CODE "
      if(CMAKE_INSTALL_DO_STRIP)
        execute_process(COMMAND \"${CMAKE_STRIP}\" --strip-debug \"\${CMAKE_INSTALL_PREFIX}/${folder}/${plugins}/${shellwarp_load_name}\"
                        COMMAND_ERROR_IS_FATAL ANY)
      endif()" ${rule})
  endif()
  foreach(licence IN ITEMS LICENSE-MIT LICENSE-APACHE THIRD_PARTY.md)
    install(FILES "${PROJECT_SOURCE_DIR}/${licence}" DESTINATION "${folder}/licences" ${rule})
  endforeach()
  set(trees "${PROJECT_BINARY_DIR}/${name}/trees")
  add_custom_target(shellwarp_${name}_tree
    COMMAND "${CMAKE_COMMAND}" -E rm -rf "${trees}"
    COMMAND "${CMAKE_COMMAND}" --install "${PROJECT_BINARY_DIR}" --component ${name} --strip --prefix "${trees}/${archive}"
    COMMENT "Placing the tree ${archive}" VERBATIM)
  add_dependencies(shellwarp_${name}_tree ${target})
endfunction()

function(shellwarp_no_plugin_tree name reason)
  add_custom_target(shellwarp_${name}_tree
    COMMAND "${CMAKE_COMMAND}" -E echo "${reason}"
    COMMAND "${CMAKE_COMMAND}" -E false VERBATIM)
endfunction()

# The system's name, as hosts write it: linux, win64 or mac.
if(WIN32)
  set(SHELLWARP_PLUGIN_PLATFORM win64)
elseif(APPLE)
  set(SHELLWARP_PLUGIN_PLATFORM mac)
else()
  set(SHELLWARP_PLUGIN_PLATFORM linux)
endif()
