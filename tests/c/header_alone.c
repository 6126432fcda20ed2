/* A translation unit with nothing but the header: see struct_layout.h. Compiled as C99 and C11. */
#include "struct_layout.h"
