# Installs the project anew, or unpacks its archive into another folder, and looks at what is there.
#
#   cmake -DBUILD=dir -DOUT=dir -DSOURCE=dir -DLIBDIR=lib [-DCPACK=…] -P install.cmake
#
# OUT/prefix is then the installation.
file(REMOVE_RECURSE "${OUT}")
file(MAKE_DIRECTORY "${OUT}")
if(CPACK)
  execute_process(COMMAND "${CPACK}" --config "${BUILD}/CPackConfig.cmake" -B "${OUT}/made" COMMAND_ERROR_IS_FATAL ANY)
  file(GLOB archive "${OUT}/made/*.tar.gz")
  file(ARCHIVE_EXTRACT INPUT "${archive}" DESTINATION "${OUT}/unpacked")
  file(GLOB folder "${OUT}/unpacked/*")
  file(RENAME "${folder}" "${OUT}/prefix")
else()
  execute_process(COMMAND "${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${OUT}/prefix" COMMAND_ERROR_IS_FATAL ANY)
endif()

foreach(name IN ITEMS include/shellwarp.h include/shellwarp.hpp ${LIBDIR}/cmake/shellwarp/shellwarpConfig.cmake
                      ${LIBDIR}/cmake/shellwarp/shellwarpConfigVersion.cmake ${LIBDIR}/pkgconfig/shellwarp.pc
                      share/shellwarp/python/shellwarp/__init__.py share/shellwarp/python/shellwarp/py.typed
                      share/doc/shellwarp/LICENSE-APACHE share/doc/shellwarp/THIRD_PARTY.md)
  if(NOT EXISTS "${OUT}/prefix/${name}")
    message(FATAL_ERROR "${name} is missing from the installation")
  endif()
endforeach()

# Nothing that finds the library may name a folder of this machine. Neither may the archive's libraries, but for what rustc
# leaves in messages of panics.
file(GLOB_RECURSE texts "${OUT}/prefix/${LIBDIR}/cmake/*" "${OUT}/prefix/${LIBDIR}/pkgconfig/*")
foreach(file IN LISTS texts)
  file(READ "${file}" text)
  foreach(place IN ITEMS "${BUILD}" "${SOURCE}" "${OUT}")
    string(FIND "${text}" "${place}" found)
    if(NOT found EQUAL -1)
      message(FATAL_ERROR "${file} names ${place}")
    endif()
  endforeach()
endforeach()
