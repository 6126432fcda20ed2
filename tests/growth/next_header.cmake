# Writes OUT, the header HEADER with a field appended to each struct.
file(READ "${HEADER}" text)
string(REGEX REPLACE "\n} (Sw[A-Za-z]+);" "\n  uint64_t appended;\n} \\1;" grown "${text}")
if(grown STREQUAL text)
  message(FATAL_ERROR "${HEADER} has no struct")
endif()
file(WRITE "${OUT}" "${grown}")
