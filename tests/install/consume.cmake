# Builds the consumer against an installation, by CMake or by pkg-config, runs it, and compares what it writes with what the
# program of the build tree writes.
#
#   cmake -DHOW=cmake|pkg-config -DKIND=shared|static -DPREFIX=dir -DLIBDIR=lib -DSOURCES=dir -DOUT=dir -DEXPECTED=file
#         -DREADELF=… -DCC=… -DCXX=… [-DPKG_CONFIG=…] -P consume.cmake
file(REMOVE_RECURSE "${OUT}")
file(MAKE_DIRECTORY "${OUT}")
set(ENV{PKG_CONFIG_PATH} "${PREFIX}/${LIBDIR}/pkgconfig")
unset(ENV{LD_LIBRARY_PATH})

function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE exit OUTPUT_VARIABLE text ERROR_VARIABLE text)
  if(NOT exit EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${exit}\n${text}")
  endif()
  set(output "${text}" PARENT_SCOPE)
endfunction()

function(build_by_cmake)
  set(library shellwarp::shellwarp)
  if(KIND STREQUAL static)
    set(library shellwarp::shellwarp_static)
  endif()
  run("${CMAKE_COMMAND}" -S "${CMAKE_CURRENT_LIST_DIR}/consumer" -B "${OUT}" "-DCMAKE_PREFIX_PATH=${PREFIX}"
      "-DSOURCES=${SOURCES}" -DLIBRARY=${library} -DCOMPONENT=${KIND} "-DCMAKE_C_COMPILER=${CC}" "-DCMAKE_CXX_COMPILER=${CXX}")
  run("${CMAKE_COMMAND}" --build "${OUT}")
endfunction()

function(build_by_pkg_config)
  set(options --cflags --libs)
  if(KIND STREQUAL static)
    list(APPEND options --static)
  endif()
  execute_process(COMMAND "${PKG_CONFIG}" ${options} shellwarp OUTPUT_VARIABLE flags OUTPUT_STRIP_TRAILING_WHITESPACE
                  COMMAND_ERROR_IS_FATAL ANY)
  separate_arguments(flags UNIX_COMMAND "${flags}")
  if(KIND STREQUAL static) # the linker takes the shared library where both are
    list(TRANSFORM flags REPLACE "^-lshellwarp$" "${PREFIX}/${LIBDIR}/libshellwarp.a")
  else()
    list(APPEND flags "-Wl,-rpath,${PREFIX}/${LIBDIR}")
  endif()
  set(static_flags ${flags} PARENT_SCOPE)
  run("${CC}" -std=c99 "${SOURCES}/strip.c" -o "${OUT}/strip_c" ${flags})
  run("${CXX}" -std=c++17 "${SOURCES}/strip.cpp" -o "${OUT}/strip_cpp" ${flags})
endfunction()

if(HOW STREQUAL cmake)
  build_by_cmake()
else()
  build_by_pkg_config()
endif()

foreach(language IN ITEMS c cpp)
  run("${READELF}" -d "${OUT}/strip_${language}")
  string(FIND "${output}" "[libshellwarp.so.0]" needs_shared)
  if((KIND STREQUAL shared AND needs_shared EQUAL -1) OR (KIND STREQUAL static AND NOT needs_shared EQUAL -1))
    message(FATAL_ERROR "strip_${language} is not linked to the ${KIND} library:\n${output}")
  endif()
  run("${OUT}/strip_${language}" "${OUT}/${language}.bin")
  message("${language}: ${output}")
  run("${CMAKE_COMMAND}" -E compare_files "${OUT}/${language}.bin" "${EXPECTED}")
endforeach()

# A program without any shared library, where the system has a static C library.
if(KIND STREQUAL static AND HOW STREQUAL pkg-config)
  execute_process(COMMAND "${CC}" -print-file-name=libc.a OUTPUT_VARIABLE libc OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(IS_ABSOLUTE "${libc}")
    run("${CC}" -std=c99 -static "${SOURCES}/strip.c" -o "${OUT}/strip_alone" ${static_flags})
    run("${READELF}" -d "${OUT}/strip_alone")
    if(output MATCHES "NEEDED")
      message(FATAL_ERROR "strip_alone needs shared libraries:\n${output}")
    endif()
    run("${OUT}/strip_alone" "${OUT}/alone.bin")
    run("${CMAKE_COMMAND}" -E compare_files "${OUT}/alone.bin" "${EXPECTED}")
  else()
    message("not tried: a program linked by -static, for there is no libc.a")
  endif()
endif()
