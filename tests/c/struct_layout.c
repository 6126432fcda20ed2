/* Prints the layout of the public structs: "SwMeshDesc 48", "SwMeshDesc.positions 8 8" (offset, size). Fails when a struct has
   padding, or a field that struct_layout.def does not name: the fields must follow each other without a gap. */
#include "struct_layout.h"

#include <stdio.h>
#include <stdlib.h>

static int gaps = 0;
static size_t end = 0, whole = 0; /* of the last field, and of the struct it is in */

static void begin_struct(const char *name, size_t size) {
  gaps += end != whole;
  end = 0;
  whole = size;
  printf("%s %zu\n", name, size);
}

static void field(const char *name, size_t offset, size_t size) {
  gaps += offset != end;
  end = offset + size;
  printf("%s %zu %zu\n", name, offset, size);
}

int main(void) {
#define STRUCT(type, size) begin_struct(#type, sizeof(type));
#define FIELD(type, name, place, size) field(#type "." #name, offsetof(type, name), sizeof(((type *)0)->name));
#include "struct_layout.def"
  gaps += end != whole;
  if (gaps) printf("%d gaps: padding, or a field that is not listed\n", gaps);
  return gaps ? EXIT_FAILURE : EXIT_SUCCESS;
}
