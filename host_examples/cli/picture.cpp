#include "picture.hpp"

#include "output_file.hpp"
#include "page.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

namespace cli {

namespace {

using Vec3 = std::array<double, 3>;

constexpr int kSide = 440, kMargin = 20;
constexpr int kShades = 120;  // of each side of the sheet, behind the ground's colour
constexpr Vec3 kGround{250, 250, 247}, kFront{62, 122, 160}, kBack{214, 126, 62};
constexpr unsigned char kGhost = 2 * kShades + 1, kMark = kGhost + 1;  // what is at rest, and dots and arrows: two more colours
constexpr Vec3 kGhostColour{222, 222, 216}, kMarkColour{40, 40, 40};
constexpr int kViews = 8;  // around the upward axis

Vec3 minus(const Vec3 &a, const Vec3 &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vec3 &a, const Vec3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 cross(const Vec3 &a, const Vec3 &b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
Vec3 unit(const Vec3 &a) {
  const double length = std::sqrt(dot(a, a));
  return length > 0 ? Vec3{a[0] / length, a[1] / length, a[2] / length} : a;
}

// Parallel rays from the side and a little above: right, up and toward the eye. The first view is the usual one, the others go around.
std::array<Vec3, 3> camera(uint32_t up, int view) {
  Vec3 toward{}, upward{};
  upward[up] = 1;
  const uint32_t side = up == 0 ? 1 : 0, front = up == 2 ? 1 : 2;  // what people call so, x to the right where they can
  toward[side] = 0.45, toward[front] = up == 1 ? 0.8 : -0.8, toward[up] = 0.4;
  const double turn = 2 * std::acos(-1.0) * view / kViews, x = toward[side], y = toward[front];
  toward[side] = std::cos(turn) * x - std::sin(turn) * y;
  toward[front] = std::sin(turn) * x + std::cos(turn) * y;
  toward = unit(toward);
  const Vec3 right = unit(cross(upward, toward));
  return {right, cross(toward, right), toward};
}

void put(std::string &bytes, uint32_t word) {
  for (int k = 3; k >= 0; --k) bytes += static_cast<char>(word >> (8 * k));
}

void add_chunk(std::string &file, const std::string &type_and_data) {
  put(file, static_cast<uint32_t>(type_and_data.size() - 4));
  uint32_t crc = ~0u;
  for (const char c : type_and_data) {
    crc ^= static_cast<unsigned char>(c);
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (crc & 1 ? 0xEDB88320u : 0);
  }
  file += type_and_data;
  put(file, ~crc);
}

// As zlib's format has it, in stored blocks: some hundred kilobytes are not worth a compressor.
std::string stored(const std::string &data) {
  constexpr std::size_t kBlock = 65535;
  std::string out = "\x78\x01";
  uint32_t a = 1, b = 0;
  for (const char c : data) a = (a + static_cast<unsigned char>(c)) % 65521, b = (b + a) % 65521;
  for (std::size_t at = 0; at < data.size(); at += kBlock) {
    const auto n = static_cast<uint32_t>(std::min(kBlock, data.size() - at));
    out += static_cast<char>(at + n == data.size());
    for (const uint32_t word : {n, ~n}) out += static_cast<char>(word), out += static_cast<char>(word >> 8);
    out.append(data, at, n);
  }
  put(out, b << 16 | a);
  return out;
}

// Of a palette's colours, row by row.
std::string png_of(const std::vector<unsigned char> &pixels, uint32_t width, uint32_t height) {
  std::string header = "IHDR", palette = "PLTE", rows;
  put(header, width);
  put(header, height);
  header += std::string("\x08\x03\x00\x00\x00", 5);
  for (int k = 0; k <= kMark; ++k)
    for (std::size_t c = 0; c < 3; ++c) {
      if (k >= kGhost) {
        palette += static_cast<char>(static_cast<unsigned char>((k == kGhost ? kGhostColour : kMarkColour)[c]));
        continue;
      }
      const Vec3 &colour = k <= kShades ? kFront : kBack;
      palette += static_cast<char>(static_cast<unsigned char>(k == 0 ? kGround[c] : std::min(255.0, colour[c] * (0.35 + 0.9 * ((k - 1) % kShades) / kShades))));
    }
  for (uint32_t y = 0; y < height; ++y) {
    rows += '\0';
    rows.append(reinterpret_cast<const char *>(&pixels[std::size_t{y} * width]), width);
  }
  std::string file = "\x89PNG\r\n\x1a\n";
  add_chunk(file, header);
  add_chunk(file, palette);
  add_chunk(file, "IDAT" + stored(rows));
  add_chunk(file, "IEND");
  return file;
}

// Panels side by side, by pixels and depth.
struct Canvas {
  static constexpr int kWidth = kSide * 3;
  std::vector<unsigned char> pixels = std::vector<unsigned char>(static_cast<std::size_t>(kWidth) * kSide);
  std::vector<double> depth = std::vector<double>(pixels.size(), -std::numeric_limits<double>::infinity());

  void put(int left, int x, int y, unsigned char colour) {
    if (x >= 0 && y >= 0 && x < kSide && y < kSide) pixels[static_cast<std::size_t>(y) * kWidth + static_cast<std::size_t>(left + x)] = colour;
  }
};

void draw_line(const Vec3 &a, const Vec3 &b, int left, Canvas &canvas) {
  const int n = 1 + static_cast<int>(2 * std::hypot(b[0] - a[0], b[1] - a[1]));
  for (int k = 0; k <= n; ++k)
    for (int w = 0; w < 4; ++w)
      canvas.put(left, static_cast<int>(a[0] + (b[0] - a[0]) * k / n) + w % 2, static_cast<int>(a[1] + (b[1] - a[1]) * k / n) + w / 2, kMark);
}

// The letters x, y and z, of strokes in a box of 8 by 10 pixels.
void draw_letter(std::size_t axis, const Vec3 &at, int left, Canvas &canvas) {
  static const std::vector<std::array<double, 4>> kStrokes[3] = {
      {{0, 0, 8, 10}, {8, 0, 0, 10}}, {{0, 0, 4, 5}, {8, 0, 4, 5}, {4, 5, 4, 10}}, {{0, 0, 8, 0}, {8, 0, 0, 10}, {0, 10, 8, 10}}};
  for (const std::array<double, 4> &s : kStrokes[axis])
    draw_line({at[0] - 4 + s[0], at[1] - 5 + s[1], 0}, {at[0] - 4 + s[2], at[1] - 5 + s[3], 0}, left, canvas);
}

void draw_arrow(const Vec3 &a, const Vec3 &b, int left, Canvas &canvas) {
  draw_line(a, b, left, canvas);
  for (const double turn : {2.6, -2.6}) {  // rad from its direction: two barbs
    const double x = 0.3 * (b[0] - a[0]), y = 0.3 * (b[1] - a[1]);
    draw_line(b, {b[0] + std::cos(turn) * x - std::sin(turn) * y, b[1] + std::sin(turn) * x + std::cos(turn) * y, 0}, left, canvas);
  }
}

// A triangle by shades at its corners; nearer ones cover it. Of a ghost the shades do not count, and all cover it.
void draw(const std::array<Vec3, 3> &p, const std::array<double, 3> &shades, bool back, int left, bool ghost, Canvas &canvas) {
  const double area = (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
  if (area == 0) return;
  const auto range = [&](std::size_t c) { return std::minmax({p[0][c], p[1][c], p[2][c]}); };
  const auto [x0, x1] = range(0);
  const auto [y0, y1] = range(1);
  for (int y = std::max(0, static_cast<int>(y0)); y <= std::min(kSide - 1, static_cast<int>(y1) + 1); ++y)
    for (int x = std::max(0, static_cast<int>(x0)); x <= std::min(kSide - 1, static_cast<int>(x1) + 1); ++x) {
      double w[3], z = 0, shade = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 &a = p[(k + 1) % 3], &b = p[(k + 2) % 3];
        w[k] = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area;
        z += w[k] * p[k][2];
        shade += w[k] * shades[k];
      }
      const std::size_t at = static_cast<std::size_t>(y) * Canvas::kWidth + static_cast<std::size_t>(left + x);
      if (w[0] < 0 || w[1] < 0 || w[2] < 0 || z <= canvas.depth[at]) continue;
      if (!ghost) canvas.depth[at] = z;
      canvas.pixels[at] = ghost ? kGhost : static_cast<unsigned char>(1 + std::clamp(static_cast<int>(kShades * shade), 0, kShades - 1) + (back ? kShades : 0));
    }
}

// Of vertices, by the area of their triangles.
std::vector<Vec3> normals_of(const std::vector<Vec3> &x, const std::vector<uint32_t> &triangles) {
  std::vector<Vec3> normals(x.size(), Vec3{});
  for (std::size_t t = 0; t < triangles.size(); t += 3) {
    const Vec3 normal = cross(minus(x[triangles[t + 1]], x[triangles[t]]), minus(x[triangles[t + 2]], x[triangles[t]]));
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t a = 0; a < 3; ++a) normals[triangles[t + c]][a] += normal[a];
  }
  for (Vec3 &normal : normals) normal = unit(normal);
  return normals;
}

// A factor of one digit for motion that is hardly seen; 1 for all other.
double larger_by(double moved, const Bounds &box) {
  constexpr double kSeen = 0.02, kDrawn = 0.1;  // of the size
  const double size = std::hypot(box.high[0] - box.low[0], box.high[1] - box.low[1], box.high[2] - box.low[2]);
  if (!(moved > 0) || moved >= kSeen * size) return 1;
  const double factor = kDrawn * size / moved, digit = std::pow(10, std::floor(std::log10(factor)));
  return std::min(1e6, std::floor(factor / digit) * digit);
}

}  // namespace

void Picture::add(const Mesh &mesh, const Film &film, const std::vector<uint32_t> &held, const Vec3 &wind, uint32_t up) {
  if (empty()) {
    up_ = up;
    wind_ = wind;
    const std::vector<double> &moved = film.displacements();
    larger_ = larger_by(*std::max_element(moved.begin(), moved.end()), bounds(mesh));
    frames_ = {0, static_cast<std::size_t>(std::max_element(moved.begin(), moved.end()) - moved.begin()), film.n_frames() - 1};
    moments_ = {film.times()[frames_[1]], film.times()[frames_[2]]};
  }
  const auto first = static_cast<uint32_t>(positions_[0].size() / 3);
  for (const uint32_t v : mesh.triangles) triangles_.push_back(first + v);
  for (const uint32_t v : held) held_.push_back(first + v);
  const std::vector<double> rest = film.positions(0);
  for (std::size_t k = 0; k < kPanels; ++k) {
    std::vector<double> at = film.positions(frames_[k]);
    for (std::size_t i = 0; i < at.size(); ++i) at[i] = rest[i] + larger_ * (at[i] - rest[i]);
    positions_[k].insert(positions_[k].end(), at.begin(), at.end());
  }
}

// Where the motion shows most; the usual view, unless another shows a quarter more.
static int best_view(const std::vector<double> &rest, const std::vector<double> &moved, uint32_t up) {
  constexpr double kClearly = 1.25;
  int best = 0;
  double most = 0;
  for (int view = 0; view < kViews; ++view) {
    const std::array<Vec3, 3> axes = camera(up, view);
    double seen = 0;
    for (std::size_t v = 0; v < rest.size(); v += 3) {
      const Vec3 u{moved[v] - rest[v], moved[v + 1] - rest[v + 1], moved[v + 2] - rest[v + 2]};
      seen += std::hypot(dot(axes[0], u), dot(axes[1], u));
    }
    if (seen > (best == 0 ? kClearly : 1) * most) best = view, most = seen;
    if (view == 0) most = seen;
  }
  return best;
}

std::string Picture::png() const {
  const std::array<Vec3, 3> axes = camera(up_, best_view(positions_[0], positions_[1], up_));
  static_assert(Canvas::kWidth == kSide * static_cast<int>(kPanels));
  Vec3 low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  std::array<std::vector<Vec3>, kPanels> seen;
  for (std::size_t k = 0; k < kPanels; ++k)
    for (std::size_t v = 0; v < positions_[k].size(); v += 3) {
      const Vec3 x{positions_[k][v], positions_[k][v + 1], positions_[k][v + 2]};
      seen[k].push_back({dot(axes[0], x), dot(axes[1], x), dot(axes[2], x)});
      for (std::size_t c = 0; c < 3; ++c) low[c] = std::min(low[c], seen[k].back()[c]), high[c] = std::max(high[c], seen[k].back()[c]);
    }
  const double extent = std::max({high[0] - low[0], high[1] - low[1], std::numeric_limits<double>::min()}), scale = (kSide - 2 * kMargin) / extent;
  for (std::vector<Vec3> &panel : seen)
    for (Vec3 &x : panel) x = {kSide / 2 + scale * (x[0] - (low[0] + high[0]) / 2), kSide / 2 - scale * (x[1] - (low[1] + high[1]) / 2), scale * x[2]};
  Canvas canvas;
  const Vec3 light = unit({0.35, -0.6, 0.75});  // pixels count downward
  const auto draw_all = [&](const std::vector<Vec3> &x, int left, bool ghost) {
    const std::vector<Vec3> normals = normals_of(x, triangles_);
    for (std::size_t t = 0; t < triangles_.size(); t += 3) {
      std::array<Vec3, 3> p;
      std::array<double, 3> shades;
      for (std::size_t c = 0; c < 3; ++c) p[c] = x[triangles_[t + c]];
      const bool back = cross(minus(p[1], p[0]), minus(p[2], p[0]))[2] > 0;
      for (std::size_t c = 0; c < 3; ++c) shades[c] = (back ? 1 : -1) * dot(normals[triangles_[t + c]], light);
      draw(p, shades, back, left, ghost, canvas);
    }
  };
  for (std::size_t k = 0; k < kPanels; ++k) {
    const int left = static_cast<int>(k) * kSide;
    if (k > 0) draw_all(seen[0], left, true);
    draw_all(seen[k], left, false);
    for (const uint32_t v : held_)
      for (int d = 0; d < 9; ++d) canvas.put(left, static_cast<int>(seen[k][v][0]) + d % 3 - 1, static_cast<int>(seen[k][v][1]) + d / 3 - 1, kMark);
  }
  for (std::size_t a = 0; a < 3; ++a) {  // the axes, at the lower right of the first
    const Vec3 from{kSide - 50, kSide - 50, 0};
    draw_line(from, {from[0] + 24 * axes[0][a], from[1] - 24 * axes[1][a], 0}, 0, canvas);
    if (std::hypot(axes[0][a], axes[1][a]) > 0.2) draw_letter(a, {from[0] + 36 * axes[0][a], from[1] - 36 * axes[1][a], 0}, 0, canvas);
  }
  if (const Vec3 blows = unit(wind_); has_wind()) {
    const double x = 32 * dot(axes[0], blows), y = -32 * dot(axes[1], blows);
    draw_arrow({50 - x, kSide - 50 - y, 0}, {50 + x, kSide - 50 + y, 0}, 0, canvas);
  }
  return png_of(canvas.pixels, Canvas::kWidth, kSide);
}

void write_picture(const Picture &picture, const std::string &path, const std::vector<std::string> &inputs) {
  OutputFolder folder = page_folder(path, inputs);
  OutputFile file(folder, std::filesystem::path(path).filename().string());
  const std::string bytes = picture.png();
  file.write(bytes.data(), bytes.size());
  file.close();
  folder.put_in_place();
}

}  // namespace cli
