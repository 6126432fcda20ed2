# Maya's C++ API: the devkit that Autodesk offers beside Maya, or a Maya that carries its headers (up to 2015).
#
# Looked for in the CMake or environment variables, in this order
#   DEVKIT_LOCATION   the unpacked devkit (its devkitBase)
#   MAYA_LOCATION     Maya's own directory
# Gives
#   Maya::Maya        OpenMaya, OpenMayaAnim and Foundation with headers and definitions
#   Maya_FOUND, Maya_INCLUDE_DIR, Maya_API_VERSION (such as 20240000, or 201600 for the older count)
#   Maya_MISSING      where not found: what is not there, and where it was looked for
set(_maya_roots "")
foreach(_variable IN ITEMS DEVKIT_LOCATION MAYA_LOCATION)
  if(${_variable})
    list(APPEND _maya_roots "${${_variable}}")
  elseif(DEFINED ENV{${_variable}})
    list(APPEND _maya_roots "$ENV{${_variable}}")
  endif()
endforeach()

# Headers and libraries of one place only: two versions side by side must not mix with what lies on the system's paths.
find_path(Maya_INCLUDE_DIR maya/MPxDeformerNode.h HINTS ${_maya_roots} PATH_SUFFIXES include devkit/include NO_DEFAULT_PATH)
set(_maya_libraries "")
foreach(_library IN ITEMS OpenMaya OpenMayaAnim Foundation)
  find_library(Maya_${_library}_LIBRARY ${_library} HINTS ${_maya_roots} PATH_SUFFIXES lib MacOS Maya.app/Contents/MacOS
               NO_DEFAULT_PATH)
  mark_as_advanced(Maya_${_library}_LIBRARY)
  list(APPEND _maya_libraries Maya_${_library}_LIBRARY)
endforeach()
mark_as_advanced(Maya_INCLUDE_DIR)

set(Maya_API_VERSION "")
if(Maya_INCLUDE_DIR AND EXISTS "${Maya_INCLUDE_DIR}/maya/MTypes.h")
  file(STRINGS "${Maya_INCLUDE_DIR}/maya/MTypes.h" _line REGEX "#define[ \t]+MAYA_API_VERSION[ \t]+[0-9]+" LIMIT_COUNT 1)
  string(REGEX MATCH "[0-9]+$" Maya_API_VERSION "${_line}")
endif()

set(Maya_MISSING "")
if(NOT _maya_roots)
  set(Maya_MISSING "no devkit (set DEVKIT_LOCATION or MAYA_LOCATION)")
elseif(NOT Maya_INCLUDE_DIR)
  set(Maya_MISSING "no include/maya/MPxDeformerNode.h")
else()
  foreach(_library IN LISTS _maya_libraries)
    if(NOT ${_library})
      string(REGEX REPLACE "Maya_(.*)_LIBRARY" "\\1" _library "${_library}")
      string(APPEND Maya_MISSING " ${_library}")
    endif()
  endforeach()
  if(Maya_MISSING)
    string(PREPEND Maya_MISSING "headers in ${Maya_INCLUDE_DIR}, but without the libraries")
  endif()
endif()
if(_maya_roots AND Maya_MISSING)
  list(JOIN _maya_roots ", " _places)
  string(APPEND Maya_MISSING "; looked in ${_places}")
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Maya REQUIRED_VARS Maya_INCLUDE_DIR ${_maya_libraries} VERSION_VAR Maya_API_VERSION)

if(Maya_FOUND AND NOT TARGET Maya::Maya)
  add_library(Maya::Maya INTERFACE IMPORTED)
  # SYSTEM: the warnings of Maya's headers are not ours to fix.
  target_include_directories(Maya::Maya SYSTEM INTERFACE "${Maya_INCLUDE_DIR}")
  foreach(_library IN LISTS _maya_libraries)
    target_link_libraries(Maya::Maya INTERFACE "${${_library}}")
  endforeach()
  if(WIN32)
    target_compile_definitions(Maya::Maya INTERFACE NT_PLUGIN REQUIRE_IOSTREAM)
  elseif(APPLE)
    target_compile_definitions(Maya::Maya INTERFACE OSMac_ _BOOL REQUIRE_IOSTREAM)
  else()
    target_compile_definitions(Maya::Maya INTERFACE LINUX _BOOL REQUIRE_IOSTREAM)
  endif()
endif()
