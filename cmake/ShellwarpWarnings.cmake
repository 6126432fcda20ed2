# shellwarp_warnings(TARGET): all warnings, and each an error.
function(shellwarp_warnings target)
  if(MSVC)
    target_compile_options(${target} PRIVATE /W4 /WX /utf-8)
    target_compile_definitions(${target} PRIVATE _CRT_SECURE_NO_WARNINGS) # the C library's own functions are fine
  else()
    target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Werror)
    if(MINGW) # C99's printf; gcc's warnings are of the older one of Windows
      target_compile_definitions(${target} PRIVATE __USE_MINGW_ANSI_STDIO=1)
      target_compile_options(${target} PRIVATE -Wno-format -Wno-format-extra-args)
    endif()
  endif()
endfunction()
