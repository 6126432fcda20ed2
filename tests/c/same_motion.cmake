# The same shell from every file format moves the same: the point caches are equal, byte for byte.
#
#   cmake -DPROGRAM=… -DMESHES=dir -DOUT=dir -P same_motion.cmake
set(files strip_quads.obj strip_negative.obj strip_triangles.obj strip.off strip_ascii.ply strip_little_endian.ply
          strip_big_endian.ply)
file(REMOVE_RECURSE "${OUT}")
foreach(file IN LISTS files)
  string(REPLACE "." "_" folder "${file}")
  execute_process(
    COMMAND "${PROGRAM}" simulate "${MESHES}/${file}" --clamp-list "${MESHES}/held.txt" --gravity 0 0 -1 --frames 10
            --modes 4 --quiet --out "${OUT}/${folder}"
    RESULT_VARIABLE exit ERROR_VARIABLE stderr)
  if(NOT exit EQUAL 0)
    message(FATAL_ERROR "${file}: exit status ${exit}: ${stderr}")
  endif()
  file(GLOB cache "${OUT}/${folder}/*.pc2")
  file(SHA256 "${cache}" hash)
  file(SIZE "${cache}" size)
  # 27 vertices, the start and 10 frames.
  if(NOT size EQUAL 3596)
    message(FATAL_ERROR "${file}: the cache has ${size} bytes, not 32 + 11 * 27 * 12")
  endif()
  if(NOT DEFINED first)
    set(first "${hash}")
  elseif(NOT hash STREQUAL first)
    message(FATAL_ERROR "${file} moves differently from strip_quads.obj")
  endif()
endforeach()
