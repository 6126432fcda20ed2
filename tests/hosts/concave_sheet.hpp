// A sheet of 8 by 2 cells that no fan cuts rightly, and the triangles that are right. In even cells two quads about a point, one of them
// concave; in odd cells a triangle and a concave pentagon. Held at the first column of the grid's vertices: 0, 1, 2.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

struct ConcaveSheet {
  std::vector<std::array<double, 2>> points;
  std::vector<std::vector<uint32_t>> polygons;
  std::vector<std::array<uint32_t, 3>> triangles;
  static constexpr uint32_t far_corner = 3 * 8;

  ConcaveSheet() {
    for (int i = 0; i <= 8; ++i)
      for (int j = 0; j <= 2; ++j) points.push_back({double(i), double(j)});
    for (uint32_t i = 0; i < 8; ++i)
      for (uint32_t j = 0; j < 2; ++j) {
        const uint32_t a = 3 * i + j, b = a + 3, c = a + 4, d = a + 1, p = static_cast<uint32_t>(points.size());
        if (i % 2 == 0) {
          points.push_back({i + 0.35, j + 0.35});
          polygons.insert(polygons.end(), {{b, p, d, a}, {b, c, d, p}});
          triangles.insert(triangles.end(), {{a, b, p}, {a, p, d}, {b, c, p}, {c, d, p}});
        } else {
          points.push_back({i + 0.45, j + 0.3});
          polygons.insert(polygons.end(), {{a, b, p}, {a, p, b, c, d}});
          triangles.insert(triangles.end(), {{a, b, p}, {p, b, c}, {p, c, d}, {d, a, p}});
        }
      }
  }
};
