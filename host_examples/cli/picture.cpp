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

Vec3 minus(const Vec3 &a, const Vec3 &b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double dot(const Vec3 &a, const Vec3 &b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec3 cross(const Vec3 &a, const Vec3 &b) { return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}; }
Vec3 unit(const Vec3 &a) {
  const double length = std::sqrt(dot(a, a));
  return length > 0 ? Vec3{a[0] / length, a[1] / length, a[2] / length} : a;
}

// Parallel rays from the side and a little above: right, up and toward the eye.
std::array<Vec3, 3> camera(uint32_t up) {
  Vec3 toward{}, upward{};
  upward[up] = 1;
  const uint32_t side = up == 0 ? 1 : 0, front = up == 2 ? 1 : 2;  // what people call so, x to the right where they can
  toward[side] = 0.45, toward[front] = up == 1 ? 0.8 : -0.8, toward[up] = 0.4;
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
  for (int k = 0; k <= 2 * kShades; ++k)
    for (std::size_t c = 0; c < 3; ++c) {
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

// A triangle in pixels and depth, by shades at its corners; nearer ones cover it.
void draw(const std::array<Vec3, 3> &p, const std::array<double, 3> &shades, bool back, int left, std::vector<double> &depth, std::vector<unsigned char> &pixels, int width) {
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
      const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(left + x);
      if (w[0] < 0 || w[1] < 0 || w[2] < 0 || z <= depth[at]) continue;
      depth[at] = z;
      pixels[at] = static_cast<unsigned char>(1 + std::clamp(static_cast<int>(kShades * shade), 0, kShades - 1) + (back ? kShades : 0));
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

void Picture::add(const Mesh &mesh, const Film &film, uint32_t up) {
  if (empty()) {
    up_ = up;
    const std::vector<double> &moved = film.displacements();
    larger_ = larger_by(*std::max_element(moved.begin(), moved.end()), bounds(mesh));
    frames_ = {0, static_cast<std::size_t>(std::max_element(moved.begin(), moved.end()) - moved.begin()), film.n_frames() - 1};
  }
  const auto first = static_cast<uint32_t>(positions_[0].size() / 3);
  for (const uint32_t v : mesh.triangles) triangles_.push_back(first + v);
  const std::vector<double> rest = film.positions(0);
  for (std::size_t k = 0; k < kPanels; ++k) {
    std::vector<double> at = film.positions(frames_[k]);
    for (std::size_t i = 0; i < at.size(); ++i) at[i] = rest[i] + larger_ * (at[i] - rest[i]);
    positions_[k].insert(positions_[k].end(), at.begin(), at.end());
  }
}

std::string Picture::png() const {
  const std::array<Vec3, 3> axes = camera(up_);
  const int width = kSide * static_cast<int>(kPanels);
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
  std::vector<unsigned char> pixels(static_cast<std::size_t>(width) * kSide);
  std::vector<double> depth(pixels.size(), -std::numeric_limits<double>::infinity());
  const Vec3 light = unit({0.35, 0.6, 0.75});
  for (std::size_t k = 0; k < kPanels; ++k) {
    const std::vector<Vec3> normals = normals_of(seen[k], triangles_);
    for (std::size_t t = 0; t < triangles_.size(); t += 3) {
      std::array<Vec3, 3> p;
      for (std::size_t c = 0; c < 3; ++c) p[c] = seen[k][triangles_[t + c]];
      const bool back = cross(minus(p[1], p[0]), minus(p[2], p[0]))[2] < 0;
      std::array<double, 3> shades;
      for (std::size_t c = 0; c < 3; ++c) shades[c] = (back ? -1 : 1) * dot(normals[triangles_[t + c]], light);
      for (Vec3 &x : p) x = {kSide / 2 + scale * (x[0] - (low[0] + high[0]) / 2), kSide / 2 - scale * (x[1] - (low[1] + high[1]) / 2), x[2]};
      draw(p, shades, back, static_cast<int>(k) * kSide, depth, pixels, width);
    }
  }
  return png_of(pixels, static_cast<uint32_t>(width), kSide);
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
