// Points that files animate: a PC2 point cache, or a numbered sequence of mesh files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cli {

class MovingPoints {
public:
  // `path` ends in .pc2, whose samples are at frames; or it is a mesh file whose name has # for the digits of a frame, as coat.####.obj.
  // Coordinates are multiplied by `scale`. Throws FileError naming the file, also where a sample has not `n_points` points.
  MovingPoints(const std::string &path, uint32_t n_points, double scale);

  // n x 3 at a frame: straight between samples, and as there before the first and after the last.
  std::vector<double> at(double frame) const;

private:
  void read_point_cache(const std::string &path, uint32_t n_points);

  std::vector<double> frames_;  // ascending
  std::vector<std::vector<float>> samples_;
};

// The files that such a path stands for. Throws FileError where there are none.
std::vector<std::string> files_of_motion(const std::string &path);

}  // namespace cli
