"""docs/reference/api.md is what the generator makes of the header today."""

import sys
import unittest

import links

sys.path.insert(0, str(links.ROOT / "docs" / "reference"))
import api_page  # noqa: E402

HEADER = """/* Things.
 *
 * Policy. None. */
#ifndef SHELLWARP_H
#define SHELLWARP_H
#include <stdint.h>

/* Meshes ---------------- */

// One | two; see SwMesh.
#define SW_ONE 1

// A mesh.
typedef struct SwMesh {
  // SW_... of it.
  uint32_t kind;
} SwMesh;

// Reads.
//
// Writes nothing.
uint32_t sw_mesh_read(const struct SwMesh *mesh,
                      double scale);

#endif
"""


class ApiPage(unittest.TestCase):
    def test_the_page_is_current(self):
        header = (links.ROOT / "include" / "shellwarp.h").read_text(encoding="utf-8")
        page = links.ROOT / "docs" / "reference" / "api.md"
        self.assertTrue(page.read_text(encoding="utf-8") == api_page.page(header), f"{page} is out of date: run `make docs-api`")

    def test_every_declaration_is_there_with_its_text(self):
        page = api_page.page(HEADER)
        for part in ["Policy. None.", "## Meshes", "| `SW_ONE` | 1 | One \\| two; see [`SwMesh`](#swmesh). |", "### SwMesh\n\nA mesh.",
                     "| `kind` | `uint32_t` | `SW_...` of it. |", "const struct SwMesh *mesh,\n", "Reads.\n\nWrites nothing."]:
            self.assertIn(part, page)

    def test_what_is_not_understood_is_refused(self):
        with self.assertRaisesRegex(ValueError, "not understood"):
            api_page.page(HEADER.replace("#define SW_ONE 1", "int some_variable;"))


if __name__ == "__main__":
    unittest.main()
