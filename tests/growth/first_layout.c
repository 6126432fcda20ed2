/* Every field of the first version is where it was; compiling is the test. */
#include "shellwarp.h"

#define STATIC_CHECK(condition) extern char static_check[(condition) ? 1 : -1]

#if UINTPTR_MAX == UINT64_MAX
#define STRUCT(type, size) STATIC_CHECK(sizeof(type) >= (size));
#define FIELD(type, name, place, size)           \
  STATIC_CHECK(offsetof(type, name) == (place)); \
  STATIC_CHECK(sizeof(((type *)0)->name) == (size));
#include "first/struct_layout.def"
#endif
