# What `cmake --install` and `cpack` put where: headers, the shared and the static library, the files by which CMake and
# pkg-config find them, the command line host, the Python package, licences. Nothing in it names a folder of this machine,
# so the whole may be moved.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Windows looks for a program's libraries beside the program.
set(shellwarp_library_folder "${CMAKE_INSTALL_LIBDIR}")
if(WIN32)
  set(shellwarp_library_folder "${CMAKE_INSTALL_BINDIR}")
endif()
set(shellwarp_static_name "${CMAKE_STATIC_LIBRARY_PREFIX}shellwarp${CMAKE_STATIC_LIBRARY_SUFFIX}")
get_filename_component(shellwarp_built_directory "${shellwarp_built}" DIRECTORY)
set(SHELLWARP_CMAKE_DIRECTORY "${CMAKE_INSTALL_LIBDIR}/cmake/shellwarp")
set(SHELLWARP_INSTALLED_LIBRARY "${shellwarp_library_folder}/${shellwarp_load_name}")

# What `cargo rustc --crate-type staticlib -- --print native-static-libs` names, but for gcc_s: compilers add it by themselves, or
# gcc_eh in its place where a program is linked with -static.
set(SHELLWARP_STATIC_NEEDS "")
if(APPLE)
  set(SHELLWARP_STATIC_NEEDS System c m)
elseif(WIN32)
  set(SHELLWARP_STATIC_NEEDS kernel32 ntdll userenv ws2_32 dbghelp)
else()
  set(SHELLWARP_STATIC_NEEDS util rt pthread m dl c)
endif()
list(TRANSFORM SHELLWARP_STATIC_NEEDS PREPEND "-l" OUTPUT_VARIABLE SHELLWARP_PC_PRIVATE)
list(JOIN SHELLWARP_PC_PRIVATE " " SHELLWARP_PC_PRIVATE)

install(FILES include/shellwarp.h include/shellwarp.hpp DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(PROGRAMS "${shellwarp_directory}/${shellwarp_load_name}" DESTINATION "${shellwarp_library_folder}")
if(NOT shellwarp_load_name STREQUAL shellwarp_plain_name)
  install(FILES "${shellwarp_directory}/${shellwarp_plain_name}" DESTINATION "${CMAKE_INSTALL_LIBDIR}")
endif()
if(WIN32)
  install(FILES "${shellwarp_directory}/${shellwarp_import_name}" DESTINATION "${CMAKE_INSTALL_LIBDIR}")
endif()
# A prebuilt shared library may come without it.
install(FILES "${shellwarp_built_directory}/${shellwarp_static_name}" DESTINATION "${CMAKE_INSTALL_LIBDIR}" OPTIONAL)
if(CMAKE_STRIP AND NOT MSVC)
  set(shellwarp_objects "${shellwarp_library_folder}/${shellwarp_load_name}")
  if(NOT WIN32) # mingw's strip stops at members without sections, which rustc puts in
    list(APPEND shellwarp_objects "${CMAKE_INSTALL_LIBDIR}/${shellwarp_static_name}")
  endif()
  install(CODE "
    if(CMAKE_INSTALL_DO_STRIP)
      foreach(object IN ITEMS ${shellwarp_objects})
        if(EXISTS \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/\${object}\")
          execute_process(COMMAND \"${CMAKE_STRIP}\" --strip-debug \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/\${object}\"
                          COMMAND_ERROR_IS_FATAL ANY)
        endif()
      endforeach()
    endif()")
endif()

configure_package_config_file(cmake/shellwarpConfig.cmake.in "${CMAKE_CURRENT_BINARY_DIR}/shellwarpConfig.cmake"
  INSTALL_DESTINATION "${SHELLWARP_CMAKE_DIRECTORY}"
  PATH_VARS CMAKE_INSTALL_INCLUDEDIR CMAKE_INSTALL_LIBDIR SHELLWARP_INSTALLED_LIBRARY)
# The interface only grows while the SONAME stays, and the SONAME carries the major version.
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/shellwarpConfigVersion.cmake" COMPATIBILITY SameMajorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/shellwarpConfig.cmake" "${CMAKE_CURRENT_BINARY_DIR}/shellwarpConfigVersion.cmake"
        DESTINATION "${SHELLWARP_CMAKE_DIRECTORY}")

file(RELATIVE_PATH SHELLWARP_PC_TO_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
string(REGEX REPLACE "/$" "" SHELLWARP_PC_TO_PREFIX "${SHELLWARP_PC_TO_PREFIX}")
configure_file(cmake/shellwarp.pc.in shellwarp.pc @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/shellwarp.pc" DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")

if(TARGET shellwarp_cli)
  set_target_properties(shellwarp_cli PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
  if(APPLE)
    set_target_properties(shellwarp_cli PROPERTIES INSTALL_RPATH "@executable_path/../${CMAKE_INSTALL_LIBDIR}")
  endif()
  install(TARGETS shellwarp_cli RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
endif()
install(DIRECTORY host_examples/python/shellwarp DESTINATION "${CMAKE_INSTALL_DATADIR}/shellwarp/python"
        FILES_MATCHING PATTERN "*.py" PATTERN py.typed PATTERN __pycache__ EXCLUDE)
# The plug-ins' sources: each version of a host needs its own build, against this installation and the host's kit.
set(SHELLWARP_PLUGINS_DESTINATION "${CMAKE_INSTALL_DATADIR}/shellwarp/plugins")
file(RELATIVE_PATH SHELLWARP_PLUGINS_TO_PREFIX "/${SHELLWARP_PLUGINS_DESTINATION}" "/")
configure_file(host_examples/plugins.cmake.in plugins/CMakeLists.txt @ONLY)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/plugins/CMakeLists.txt" LICENSE-MIT LICENSE-APACHE THIRD_PARTY.md
        DESTINATION "${SHELLWARP_PLUGINS_DESTINATION}")
install(FILES cmake/FindMaya.cmake cmake/ShellwarpPluginTree.cmake DESTINATION "${SHELLWARP_PLUGINS_DESTINATION}/cmake")
install(DIRECTORY host_examples/common host_examples/maya host_examples/houdini DESTINATION "${SHELLWARP_PLUGINS_DESTINATION}/host_examples")

install(FILES LICENSE-MIT LICENSE-APACHE THIRD_PARTY.md README.md CHANGELOG.md DESTINATION "${CMAKE_INSTALL_DOCDIR}")

set(CPACK_GENERATOR TGZ)
set(CPACK_PACKAGE_NAME shellwarp)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Real-time thin shells by modal warping")
set(CPACK_STRIP_FILES ON)
string(TOLOWER "shellwarp-${PROJECT_VERSION}-${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR}" CPACK_PACKAGE_FILE_NAME)
set(CPACK_VERBATIM_VARIABLES ON)
include(CPack)
