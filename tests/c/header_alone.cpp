// As header_alone.c in C++17, and the C++ wrapper alone and twice.
#include "struct_layout.h"

#include "shellwarp.hpp"
#include "shellwarp.hpp"
