/* The header compiles alone, twice, and lays its structs out as struct_layout.def says, in C99, C11 and C++17. */
#include "shellwarp.h"
#include "shellwarp.h"

/* C99 has no static assertion; an array that would have a negative size serves in every language. */
#define STATIC_CHECK(condition) extern char static_check[(condition) ? 1 : -1]

#if UINTPTR_MAX == UINT64_MAX
#define STRUCT(type, size) STATIC_CHECK(sizeof(type) == (size));
#define FIELD(type, name, place, size)           \
  STATIC_CHECK(offsetof(type, name) == (place)); \
  STATIC_CHECK(sizeof(((type *)0)->name) == (size));
#include "struct_layout.def"
#undef STRUCT
#undef FIELD
#endif
