# What the shared library exports is what exported_symbols.txt lists, and it carries the name that hosts load.
#
#   cmake -DNM=… -DREADELF=… -DLIBRARY=… -DLIST=… -DSONAME=… -P check_exports.cmake
execute_process(COMMAND "${NM}" -D --defined-only --format=posix "${LIBRARY}" OUTPUT_VARIABLE table COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n]+" lines "${table}")
list(TRANSFORM lines REPLACE " .*" "")
list(SORT lines)

file(STRINGS "${LIST}" expected REGEX "^[^#]")
list(SORT expected)
if(NOT lines STREQUAL expected)
  set(extra ${lines})
  set(missing ${expected})
  list(REMOVE_ITEM extra ${expected})
  list(REMOVE_ITEM missing ${lines})
  message(FATAL_ERROR "exported but not listed: ${extra}\nlisted but not exported: ${missing}")
endif()

execute_process(COMMAND "${READELF}" -d "${LIBRARY}" OUTPUT_VARIABLE dynamic COMMAND_ERROR_IS_FATAL ANY)
if(NOT dynamic MATCHES "SONAME[^\n]*\\[${SONAME}\\]")
  message(FATAL_ERROR "the SONAME is not ${SONAME}:\n${dynamic}")
endif()
