# Makes the C++ file `out`, which defines the array `name` of `header` as a text that ends in 0.
function(shellwarp_embed_text out header name text)
  string(HEX "${text}" bytes)  # a list of numbers: compilers bound the length of a literal
  string(REGEX REPLACE "(................................)" "\\1\n" bytes "${bytes}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "'\\\\x\\1'," bytes "${bytes}")
  file(CONFIGURE OUTPUT "${out}" @ONLY CONTENT
    "// Made by player/embed.cmake.\n#include \"@header@\"\n\nnamespace cli {\n\nconst char @name@[] = {\n@bytes@0};\n\n}\n")
endfunction()

# The player's files: the page as one text, with {{motion}} where the data goes.
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
  shellwarp_embed_text("${out}" page.hpp kPlayerPage "${page}")
endfunction()

# By what editors complete and check scenes.
function(shellwarp_embed_schema out)
  set(file "${PROJECT_SOURCE_DIR}/docs/reference/scene.schema.json")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${file}")
  file(READ "${file}" text)
  shellwarp_embed_text("${out}" new_scene.hpp kSceneSchema "${text}")
endfunction()
