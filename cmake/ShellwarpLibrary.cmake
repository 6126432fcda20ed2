# The target shellwarp::shellwarp: the shared library that cargo builds, or a prebuilt one, and its headers.
#
# Settings
#   SHELLWARP_PREBUILT_LIBRARY  path of a libshellwarp built elsewhere; cargo is then not needed
#   SHELLWARP_CARGO             the cargo to use; found by $CARGO, then on the path, then in ~/.cargo/bin
#   SHELLWARP_CARGO_FLAGS       further arguments to cargo build, such as --locked;--offline
# Cargo's own environment is honoured: CARGO_TARGET_DIR, CARGO_BUILD_JOBS, CARGO_NET_OFFLINE.

set(SHELLWARP_PREBUILT_LIBRARY "" CACHE FILEPATH "A libshellwarp built elsewhere; empty = build it with cargo")
set(SHELLWARP_CARGO_FLAGS "" CACHE STRING "Further arguments to cargo build, separated by semicolons")

# The library is loaded under the name that it carries inside, which is not the name that cargo gives to the file. So a copy
# of that name is made, and beside it a link of the plain name.
set(SHELLWARP_SOVERSION ${PROJECT_VERSION_MAJOR})
set(shellwarp_directory "${CMAKE_CURRENT_BINARY_DIR}/lib")
set(shellwarp_plain_name "${CMAKE_SHARED_LIBRARY_PREFIX}shellwarp${CMAKE_SHARED_LIBRARY_SUFFIX}")
if(WIN32)
  set(shellwarp_plain_name shellwarp.dll)
  set(shellwarp_load_name shellwarp.dll)
  set(shellwarp_import_name shellwarp.dll.lib) # what a program is linked to
  if(MINGW)
    set(shellwarp_import_name libshellwarp.dll.a)
  endif()
elseif(APPLE)
  set(shellwarp_load_name ${shellwarp_plain_name})
else()
  set(shellwarp_load_name "${shellwarp_plain_name}.${SHELLWARP_SOVERSION}")
endif()

function(shellwarp_find_cargo)
  if(DEFINED ENV{CARGO} AND NOT SHELLWARP_CARGO)
    set(SHELLWARP_CARGO "$ENV{CARGO}" CACHE FILEPATH "The cargo that builds the library")
  endif()
  find_program(SHELLWARP_CARGO cargo HINTS "$ENV{HOME}/.cargo/bin" "$ENV{USERPROFILE}/.cargo/bin"
               DOC "The cargo that builds the library")
  if(NOT SHELLWARP_CARGO)
    message(FATAL_ERROR "cargo is missing: install Rust (https://rustup.rs), or set SHELLWARP_CARGO, or set "
                        "SHELLWARP_PREBUILT_LIBRARY to a library built elsewhere")
  endif()
endfunction()

# Sets shellwarp_built to where cargo leaves the library.
if(SHELLWARP_PREBUILT_LIBRARY)
  if(NOT EXISTS "${SHELLWARP_PREBUILT_LIBRARY}")
    message(FATAL_ERROR "SHELLWARP_PREBUILT_LIBRARY does not exist: ${SHELLWARP_PREBUILT_LIBRARY}")
  endif()
  set(shellwarp_built "${SHELLWARP_PREBUILT_LIBRARY}")
else()
  shellwarp_find_cargo()
  set(shellwarp_target_directory "${PROJECT_SOURCE_DIR}/target")
  if(DEFINED ENV{CARGO_TARGET_DIR})
    get_filename_component(shellwarp_target_directory "$ENV{CARGO_TARGET_DIR}" ABSOLUTE BASE_DIR "${PROJECT_SOURCE_DIR}")
  endif()
  set(shellwarp_built "${shellwarp_target_directory}/release/${shellwarp_plain_name}")
  # Always run: cargo knows best whether there is anything to do.
  add_custom_target(shellwarp_cargo
    COMMAND "${CMAKE_COMMAND}" -E env "CARGO_TARGET_DIR=${shellwarp_target_directory}"
            "${SHELLWARP_CARGO}" build --locked --release --lib ${SHELLWARP_CARGO_FLAGS}
    WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
    BYPRODUCTS "${shellwarp_built}"
    COMMENT "cargo build --locked --release"
    USES_TERMINAL VERBATIM)
endif()

set(shellwarp_link_command "")
if(NOT shellwarp_load_name STREQUAL shellwarp_plain_name)
  set(shellwarp_link_command
    COMMAND "${CMAKE_COMMAND}" -E create_symlink "${shellwarp_load_name}" "${shellwarp_directory}/${shellwarp_plain_name}")
endif()
if(WIN32)
  get_filename_component(shellwarp_import_library "${shellwarp_built}" DIRECTORY)
  list(APPEND shellwarp_link_command
    COMMAND "${CMAKE_COMMAND}" -E copy_if_different "${shellwarp_import_library}/${shellwarp_import_name}"
            "${shellwarp_directory}/${shellwarp_import_name}")
endif()

add_custom_target(shellwarp_library ALL
  COMMAND "${CMAKE_COMMAND}" -E make_directory "${shellwarp_directory}"
  COMMAND "${CMAKE_COMMAND}" -E copy_if_different "${shellwarp_built}" "${shellwarp_directory}/${shellwarp_load_name}"
  ${shellwarp_link_command}
  BYPRODUCTS "${shellwarp_directory}/${shellwarp_load_name}"
  COMMENT "Placing ${shellwarp_load_name}"
  VERBATIM)
if(TARGET shellwarp_cargo)
  add_dependencies(shellwarp_library shellwarp_cargo)
endif()

add_library(shellwarp::shellwarp SHARED IMPORTED GLOBAL)
add_dependencies(shellwarp::shellwarp shellwarp_library)
set_target_properties(shellwarp::shellwarp PROPERTIES
  IMPORTED_LOCATION "${shellwarp_directory}/${shellwarp_load_name}"
  INTERFACE_INCLUDE_DIRECTORIES "${PROJECT_SOURCE_DIR}/include")
if(WIN32)
  set_target_properties(shellwarp::shellwarp PROPERTIES IMPORTED_IMPLIB "${shellwarp_directory}/${shellwarp_import_name}")
elseif(NOT APPLE)
  set_target_properties(shellwarp::shellwarp PROPERTIES IMPORTED_SONAME "${shellwarp_load_name}")
endif()
