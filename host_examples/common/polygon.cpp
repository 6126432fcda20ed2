#include "polygon.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace host {

namespace {

using Vec3 = std::array<double, 3>;

// Qualities that differ by less are the same: of a square's four ears none is better.
constexpr double kSame = 1e-9;

Vec3 minus(const Vec3 &a, const Vec3 &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3 cross(const Vec3 &a, const Vec3 &b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Vec3 &a, const Vec3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Vec3 &a) { return std::hypot(a[0], a[1], a[2]); }

class Cutter {
public:
  Cutter(const std::vector<uint32_t> &corners, const double *positions) : left_(corners), positions_(positions) {
    const std::size_t n = corners.size();
    const Vec3 first = at(0);  // twice the area as a vector, without the digits of a far place (Newell)
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3 part = cross(minus(at(i), first), minus(at((i + 1) % n), first));
      for (std::size_t c = 0; c < 3; ++c) normal_[c] += part[c];
    }
    const double size = length(normal_);
    for (double &x : normal_) x /= size;
    sound_ = size > 0 && std::isfinite(size);
  }

  std::vector<uint32_t> cut() {
    std::vector<uint32_t> triangles;
    while (left_.size() > 3 && sound_) {
      const std::size_t tip = left_.size() == 4 ? tip_of_quad() : best_ear();
      if (tip == left_.size()) break;
      const std::size_t n = left_.size();
      triangles.insert(triangles.end(), {left_[(tip + n - 1) % n], left_[tip], left_[(tip + 1) % n]});
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(tip));
    }
    for (std::size_t k = 2; k < left_.size(); ++k) triangles.insert(triangles.end(), {left_[0], left_[k - 1], left_[k]});
    return triangles;
  }

private:
  Vec3 at(std::size_t i) const {
    const double *x = &positions_[3 * std::size_t{left_[i]}];
    return {x[0], x[1], x[2]};
  }

  // Twice the area over the square of the longest side: 0.87 of an equilateral triangle, at most 0 of one that is turned over.
  double quality(std::size_t a, std::size_t b, std::size_t c) const {
    const Vec3 ab = minus(at(b), at(a)), bc = minus(at(c), at(b)), ca = minus(at(a), at(c));
    const double longest = std::max({dot(ab, ab), dot(bc, bc), dot(ca, ca)});
    return longest > 0 ? dot(cross(ab, bc), normal_) / longest : 0;
  }

  bool is_before(std::size_t a, std::size_t b) const { return at(a) < at(b); }

  // The tip of the first triangle by the better diagonal, of a square's the one from its lowest corner; the end where neither lies inside.
  std::size_t tip_of_quad() const {
    const double even = std::min(quality(3, 0, 1), quality(1, 2, 3)), odd = std::min(quality(0, 1, 2), quality(2, 3, 0));
    if (!(std::max(even, odd) > 0)) return 4;
    std::size_t lowest = 0;
    for (std::size_t i = 1; i < 4; ++i) lowest = is_before(i, lowest) ? i : lowest;
    const bool same = std::fabs(even - odd) <= kSame;
    return same ? (lowest + 1) % 4 : even > odd ? 0 : 1;
  }

  bool holds_another(std::size_t a, std::size_t b, std::size_t c) const {
    for (std::size_t i = 0; i < left_.size(); ++i) {
      if (i == a || i == b || i == c || at(i) == at(a) || at(i) == at(b) || at(i) == at(c)) continue;
      const auto inward = [&](std::size_t p, std::size_t q) { return dot(cross(minus(at(q), at(p)), minus(at(i), at(p))), normal_); };
      if (inward(a, b) >= 0 && inward(b, c) >= 0 && inward(c, a) >= 0) return true;
    }
    return false;
  }

  std::size_t best_ear() const {
    const std::size_t n = left_.size();
    std::size_t best = n;
    double most = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t before = (i + n - 1) % n, after = (i + 1) % n;
      const double own = quality(before, i, after);
      const bool better = own > most + kSame, as_good = best < n && own > most - kSame && is_before(i, best);
      if (!(own > 0 && (better || as_good)) || holds_another(before, i, after)) continue;
      best = i;
      most = std::max(own, most);
    }
    return best;
  }

  std::vector<uint32_t> left_;
  const double *positions_;
  Vec3 normal_{};
  bool sound_ = false;
};

}  // namespace

std::vector<uint32_t> cut_polygon(const std::vector<uint32_t> &corners, const double *positions) {
  return corners.size() == 3 ? corners : Cutter(corners, positions).cut();
}

std::vector<uint32_t> cut_polygons(const std::vector<uint32_t> &sizes, const std::vector<uint32_t> &corners, const double *positions) {
  std::vector<uint32_t> triangles, polygon;
  auto next = corners.begin();
  for (const uint32_t size : sizes) {
    polygon.assign(next, next + size);
    next += size;
    const std::vector<uint32_t> cut = cut_polygon(polygon, positions);
    triangles.insert(triangles.end(), cut.begin(), cut.end());
  }
  return triangles;
}

}  // namespace host
