#include "fibres.hpp"

#include "section.hpp"

#include <optional>
#include <stdexcept>

namespace cli {

namespace {

// Three numbers a line, a line a triangle.
std::vector<double> read_directions(const std::string &path) {
  const std::string contents = read_file(path);
  TextLines lines(path, contents);
  std::vector<double> numbers;
  while (lines.next_line()) {
    const std::string name = "direction " + std::to_string(numbers.size() / 3);
    for (int k = 0; k < 3; ++k) numbers.push_back(lines.number(name));
    if (lines.has_word()) lines.fail(name + " has more than three numbers");
  }
  if (numbers.empty()) throw FileError(path, 0, "has no direction");
  return numbers;
}

}  // namespace

void read_fibres(Section &section, Material &material, std::vector<std::string> &inputs) {
  const std::optional<double> across = section.number("young_across"), shear = section.number("shear");
  material.directions = section.numbers("direction", 3);
  const bool one = !material.directions.empty();
  const auto path = section.file("directions");
  for (const char *key : {"shear", "direction", "directions"})
    if (section.find(key) && !across) section.fail(*section.find(key), std::string(key) + " goes with young_across");
  if (!across) return;
  if (!material.sheet) section.fail(*section.find("young_across"), "young_across goes with a sheet: give young or preset");
  material.young_across = section.positive("young_across", 0);
  if (shear) material.shear = section.positive("shear", 0);
  if (path && one) section.fail(*section.find("directions"), "give direction or directions, not both");
  if (path) {
    inputs.push_back(*path);
    material.directions_path = *path;
    material.directions = read_directions(*path);
  }
  if (material.directions.empty()) section.fail("young_across needs a direction, three numbers, or a file of directions");
}

std::vector<double> find_directions(const Material &material, const Mesh &mesh) {
  if (material.directions_path.empty()) return material.directions;
  const std::size_t n = material.directions.size() / 3, triangles = mesh.triangles_of_file();
  if (n != triangles)
    throw std::runtime_error(material.directions_path + ": " + std::to_string(n) + " directions; the mesh has " + std::to_string(triangles) +
                             " triangles");
  return !mesh.of_file.empty() ? mesh.carried_by_triangles(material.directions, 3) : material.directions;
}

}  // namespace cli
