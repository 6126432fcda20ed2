# Makes OUT.cpp of the player's files: the page as one text, with {{motion}} where the data goes.
function(shellwarp_embed_player out)
  set(folder "${CMAKE_CURRENT_SOURCE_DIR}/player")
  set(parts page.html style.css motion.js solids.js painter.js player.js aside.js)
  list(TRANSFORM parts PREPEND "${folder}/")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${parts})
  foreach(part IN LISTS parts)
    file(READ "${part}" text)
    get_filename_component(extension "${part}" EXT)
    string(APPEND player${extension} "${text}")
  endforeach()
  string(REPLACE "{{style}}" "${player.css}" page "${player.html}")
  string(REPLACE "{{script}}" "${player.js}" page "${page}")
  string(HEX "${page}" bytes)  # a list of numbers: compilers bound the length of a literal
  string(REGEX REPLACE "(................................)" "\\1\n" bytes "${bytes}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${bytes}")
  file(CONFIGURE OUTPUT "${out}" @ONLY CONTENT
    "// Made by player/embed.cmake.\n#include \"page.hpp\"\n\nnamespace cli {\n\nconst char kPlayerPage[] = {\n@bytes@0};\n\n}\n")
endfunction()
