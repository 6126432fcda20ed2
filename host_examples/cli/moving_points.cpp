#include "moving_points.hpp"

#include "mesh.hpp"
#include "point_cache.hpp"
#include "text_lines.hpp"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>

namespace cli {

namespace {

constexpr std::size_t kHeader = 32;

// By the number in the name, the files of a sequence.
std::map<uint32_t, std::string> sequence_of(const std::string &path) {
  namespace fs = std::filesystem;
  const fs::path pattern(path);
  const std::string name = pattern.filename().string();
  const std::size_t first = name.find('#'), last = name.rfind('#');
  if (first == std::string::npos) throw FileError(path, 0, "is neither a .pc2 file nor a mesh file with # in its name for the digits of a frame, as coat.####.obj");
  const std::string before = name.substr(0, first), after = name.substr(last + 1);
  if (name.find_first_not_of('#', first) < last) throw FileError(path, 0, "has # in two places");
  std::map<uint32_t, std::string> found;
  std::error_code none;
  const fs::path folder = pattern.has_parent_path() ? pattern.parent_path() : fs::path(".");
  for (const fs::directory_entry &entry : fs::directory_iterator(folder, none)) {
    const std::string file = entry.path().filename().string();
    if (file.size() < before.size() + after.size() + (last + 1 - first) || file.compare(0, before.size(), before) != 0 ||
        file.compare(file.size() - after.size(), after.size(), after) != 0)
      continue;
    uint32_t frame = 0;
    if (parse_whole(std::string_view(file).substr(before.size(), file.size() - before.size() - after.size()), frame)) found[frame] = entry.path().string();
  }
  if (found.empty()) throw FileError(path, 0, "no file has such a name");
  return found;
}

bool is_point_cache(const std::string &path) { return std::filesystem::path(path).extension() == ".pc2"; }

template <class T>
T number_at(const std::string &bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

std::string counts(std::size_t found, std::size_t expected) {
  return "has " + std::to_string(found) + " points, and the mesh " + std::to_string(expected) + " vertices";
}

}  // namespace

std::vector<std::string> files_of_motion(const std::string &path) {
  if (is_point_cache(path)) return {path};
  std::vector<std::string> files;
  for (const auto &[frame, file] : sequence_of(path)) files.push_back(file);
  return files;
}

MovingPoints::MovingPoints(const std::string &path, uint32_t n_points, double scale) {
  if (is_point_cache(path)) {
    read_point_cache(path, n_points);
  } else {
    for (const auto &[frame, file] : sequence_of(path)) {
      const Mesh mesh = read_mesh(file);
      if (mesh.n_vertices() != n_points) throw FileError(file, 0, counts(mesh.n_vertices(), n_points));
      frames_.push_back(frame);
      samples_.emplace_back(mesh.positions.begin(), mesh.positions.end());
    }
  }
  for (std::vector<float> &sample : samples_)
    for (float &x : sample) x = static_cast<float>(scale * static_cast<double>(x));
}

void MovingPoints::read_point_cache(const std::string &path, uint32_t n_points) {
  const std::string bytes = read_file(path);
  if (bytes.size() < kHeader || bytes.compare(0, sizeof kPointCacheMagic, kPointCacheMagic, sizeof kPointCacheMagic) != 0) throw FileError(path, 0, "is no PC2 point cache");
  const auto count = number_at<int32_t>(bytes, 16), samples = number_at<int32_t>(bytes, 28);
  const double start = static_cast<double>(number_at<float>(bytes, 20)), rate = static_cast<double>(number_at<float>(bytes, 24));
  if (count < 0 || static_cast<uint32_t>(count) != n_points) throw FileError(path, 0, counts(static_cast<uint32_t>(count), n_points));
  const std::size_t size = 12 * std::size_t{n_points};
  if (samples < 1 || !(rate > 0) || (bytes.size() - kHeader) / std::max<std::size_t>(size, 1) < static_cast<std::size_t>(samples))
    throw FileError(path, 0, "is cut off, or has no samples");
  for (std::size_t k = 0; k < static_cast<std::size_t>(samples); ++k) {
    frames_.push_back(start + rate * static_cast<double>(k));
    samples_.emplace_back(3 * std::size_t{n_points});
    std::memcpy(samples_.back().data(), bytes.data() + kHeader + k * size, size);
  }
}

std::vector<double> MovingPoints::at(double frame) const {
  const auto after = static_cast<std::size_t>(std::upper_bound(frames_.begin(), frames_.end(), frame) - frames_.begin());
  const std::size_t k = after == 0 ? 0 : after - 1, next = std::min(k + 1, frames_.size() - 1);
  const double share = next == k ? 0 : std::clamp((frame - frames_[k]) / (frames_[next] - frames_[k]), 0.0, 1.0);
  std::vector<double> points(samples_[k].begin(), samples_[k].end());
  for (std::size_t i = 0; share > 0 && i < points.size(); ++i) points[i] += share * (static_cast<double>(samples_[next][i]) - points[i]);
  return points;
}

}  // namespace cli
