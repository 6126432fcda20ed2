#include "material_maps.hpp"

#include "read_where.hpp"
#include "section.hpp"
#include "shell.hpp"

#include <algorithm>
#include <stdexcept>

namespace cli {

namespace {

struct Quantity {
  const char *key;
  uint32_t map;
  bool of_sheet;
  double Material::*uniform;
};

constexpr Quantity kQuantities[] = {
    {"k_area", SW_MAP_K_AREA, false, &Material::k_area},
    {"k_length", SW_MAP_K_LENGTH, false, &Material::k_length},
    {"k_bend", SW_MAP_K_BEND, false, &Material::k_bend},
    {"density", SW_MAP_AREA_DENSITY, false, &Material::density},
    {"young", SW_MAP_YOUNG, true, &Material::young},
    {"thickness", SW_MAP_THICKNESS, true, &Material::thickness},
    {"volume_density", SW_MAP_VOLUME_DENSITY, true, &Material::volume_density},
    {"growth", SW_MAP_GROWTH, true, &Material::growth},  // of any material
};

const Quantity &quantity_of(uint32_t map) {
  return *std::find_if(std::begin(kQuantities), std::end(kQuantities), [&](const Quantity &q) { return q.map == map; });
}

// Fails where the constant is none of this material's.
void check_fits(Section &section, const Quantity &q, const Material &material) {
  if (q.map == SW_MAP_GROWTH) return;
  const toml::node *node = section.find(q.key);
  if (q.of_sheet != material.sheet)
    section.fail(*node, std::string(q.key) + (q.of_sheet ? " varies over a sheet alone: give young or preset in [material]"
                                                         : " does not go with a sheet: it has young, thickness and volume_density"));
  if (material.by_look() && q.map != SW_MAP_AREA_DENSITY)
    section.fail(*node, std::string(q.key) + " does not go with " + (material.sag > 0 ? "sag" : "frequency") + ", which sets it");
}

void read_files(Section section, Material &material, std::vector<std::string> &inputs) {
  for (const Quantity &q : kQuantities) {
    const std::optional<std::string> path = section.file(q.key);
    if (!path) continue;
    check_fits(section, q, material);
    inputs.push_back(*path);
    material.files.push_back({q.map, *path, read_numbers(*path, q.key, false)});
  }
  section.reject_unknown_keys();
}

MaterialRegion read_region(Section section, const Material &material, std::vector<std::string> &inputs) {
  MaterialRegion region;
  region.place = section.place();
  region.where = read_where(section, inputs);
  for (const Quantity &q : kQuantities) {
    if (!section.find(q.key)) continue;
    check_fits(section, q, material);
    region.values.emplace_back(q.map, section.positive(q.key, 0));
  }
  section.reject_unknown_keys();
  if (region.values.empty()) section.fail(material.sheet ? "give a young, thickness, volume_density or growth of its own"
                                                         : "give a k_area, k_length, k_bend, density or growth of its own");
  return region;
}

void set_region(const std::string &place, const std::vector<uint32_t> &vertices, double value, const Mesh &mesh, MaterialFile &map) {
  const char *key = quantity_of(map.quantity).key;
  if (map.values.size() != mesh.n_vertices())
    throw std::runtime_error(map.path + ": " + key + " is given by triangles, so no region can have its own");
  for (const uint32_t v : vertices) {
    if (v >= mesh.n_vertices())
      throw std::runtime_error(place + " a region of " + key + " names vertex " + std::to_string(v) + "; the mesh has " +
                               std::to_string(mesh.n_vertices()));
    map.values[v] = value;
  }
}

// A file's numbers at the vertices or triangles that are simulated.
void fit(MaterialFile &map, const Mesh &mesh) {
  const std::size_t n = map.values.size(), vertices = mesh.vertices_of_file(), triangles = mesh.triangles_of_file();
  if (n != vertices && n != triangles)
    throw std::runtime_error(map.path + ": " + std::to_string(n) + " values of " + quantity_of(map.quantity).key + "; the mesh has " +
                             std::to_string(vertices) + " vertices and " + std::to_string(triangles) + " triangles");
  if (!mesh.of_file.empty()) map.values = n == vertices ? mesh.carried(map.values) : mesh.carried_by_triangles(map.values);
}

// The map of a constant; one of the uniform value where there is none yet.
MaterialFile &map_of(uint32_t quantity, const Material &material, const Mesh &mesh, std::vector<MaterialFile> &maps) {
  for (MaterialFile &map : maps)
    if (map.quantity == quantity) return map;
  maps.push_back({quantity, "", std::vector<double>(mesh.n_vertices(), material.*quantity_of(quantity).uniform)});
  return maps.back();
}

// A constant on a triangle: its own, or the mean of its corners'.
double on_triangle(uint32_t quantity, const Material &material, const std::vector<MaterialFile> &maps, const Mesh &mesh, std::size_t t) {
  for (const MaterialFile &map : maps) {
    if (map.quantity != quantity) continue;
    if (map.values.size() != mesh.n_vertices()) return map.values[t];
    const uint32_t *corner = &mesh.triangles[3 * t];
    return (map.values[corner[0]] + map.values[corner[1]] + map.values[corner[2]]) / 3;
  }
  return material.*quantity_of(quantity).uniform;
}

}  // namespace

std::vector<double> read_numbers(const std::string &path, const std::string &key, bool or_zero) {
  const std::string contents = read_file(path);
  TextLines lines(path, contents);
  std::vector<double> values;
  while (lines.next_line())
    while (lines.has_word()) {
      const std::string name = key + " " + std::to_string(values.size());
      values.push_back(lines.number(name));
      if (!(values.back() > 0 || (or_zero && values.back() == 0)))
        lines.fail(name + (or_zero ? " must not be negative" : " must be greater than 0"));
    }
  return values;
}

void read_maps(Section &section, Material &material, std::vector<std::string> &inputs) {
  if (auto files = section.section("map")) read_files(*files, material, inputs);
  for (Section &region : section.sections("region")) material.regions.push_back(read_region(std::move(region), material, inputs));
}

std::vector<MaterialFile> material_maps(const Material &material, const Mesh &mesh) {
  std::vector<MaterialFile> maps = material.files;
  for (MaterialFile &map : maps) fit(map, mesh);
  for (const MaterialRegion &region : material.regions) {
    const std::vector<uint32_t> vertices = find_vertices(region.where, mesh, region.place);
    for (const auto &[quantity, value] : region.values)
      set_region(region.place, vertices, value, mesh, map_of(quantity, material, mesh, maps));
  }
  return maps;
}

std::vector<double> masses_per_area(const Material &material, const Mesh &mesh) {
  const std::vector<MaterialFile> maps = material_maps(material, mesh);
  std::vector<double> masses(mesh.n_triangles());
  for (std::size_t t = 0; t < masses.size(); ++t)
    masses[t] = !material.sheet ? on_triangle(SW_MAP_AREA_DENSITY, material, maps, mesh, t)
                                : on_triangle(SW_MAP_VOLUME_DENSITY, material, maps, mesh, t) *
                                      on_triangle(SW_MAP_THICKNESS, material, maps, mesh, t);
  return masses;
}

void stiffen_bending(Material &material, double factor) {
  material.k_bend *= factor;
  for (double *modulus : {&material.young, &material.young_across, &material.shear}) *modulus *= factor;
  const auto bends = [](uint32_t quantity) { return quantity == SW_MAP_K_BEND || quantity == SW_MAP_YOUNG; };
  for (MaterialFile &map : material.files)
    if (bends(map.quantity))
      for (double &value : map.values) value *= factor;
  for (MaterialRegion &region : material.regions)
    for (auto &[quantity, value] : region.values)
      if (bends(quantity)) value *= factor;
}

}  // namespace cli
