#include "ties.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace cli {

namespace {

using Pair = std::array<uint32_t, 2>;

std::vector<Pair> read_pairs(Section &section, const char *key, const std::string &what, const std::string &whats) {
  const toml::node *node = section.find(key);
  const toml::array *list = node ? node->as_array() : nullptr;
  std::vector<Pair> pairs;
  for (std::size_t i = 0; list && i < list->size(); ++i) {
    const toml::array *pair = (*list)[i].as_array();
    const bool two = pair && pair->size() == 2;
    const auto a = two ? (*pair)[0].value<uint32_t>() : std::nullopt, b = two ? (*pair)[1].value<uint32_t>() : std::nullopt;
    if (!a || !b) section.fail((*list)[i], "pair " + std::to_string(i) + " of " + key + " must be " + what + ", counted from 0");
    pairs.push_back({*a, *b});
  }
  if (node && pairs.empty()) section.fail(*node, std::string(key) + " must be a list of pairs of " + whats);
  return pairs;
}

}  // namespace

SceneTie read_tie(Section section) {
  SceneTie tie;
  tie.vertices = read_pairs(section, "vertices", "two vertices", "vertices");
  tie.triangles = read_pairs(section, "triangles", "a vertex and a triangle", "vertices and triangles");
  if (const auto within = section.number("within")) {
    if (!(*within > 0)) section.fail(*section.find("within"), "within must be above 0");
    tie.within = *within;
  }
  if (const auto stiffness = section.number("stiffness")) {
    if (!(*stiffness > 0)) section.fail(*section.find("stiffness"), "stiffness must be above 0; without it a tie is stiff");
    if (tie.within > 0) section.fail(*section.find("stiffness"), "what touches is tied stiffly: stiffness goes with vertices or triangles");
    tie.stiffness = *stiffness;
  }
  section.reject_unknown_keys();
  if (tie.vertices.empty() && tie.triangles.empty() && !(tie.within > 0)) section.fail("a tie needs vertices, triangles or within");
  return tie;
}

TieLists find_ties(const Scene &scene, const Mesh &mesh) {
  TieLists lists;
  const auto add = [&lists](const Pair &ends, bool on_triangle, double stiffness) {
    lists.ends.push_back(ends);
    lists.on_triangles.push_back(on_triangle ? 1 : 0);
    lists.stiffness.push_back(stiffness);
  };
  for (const SceneTie &tie : scene.ties) {
    if (!tie.triangles.empty() && !mesh.of_file.empty())
      throw std::runtime_error("tie: triangles are numbered anew by weld and proxy: tie by vertices or within");
    for (const Pair &ends : tie.vertices) {
      const uint32_t n = mesh.vertices_of_file();
      if (std::max(ends[0], ends[1]) >= n)
        throw std::runtime_error("tie: vertex " + std::to_string(std::max(ends[0], ends[1])) + " is not one of the file's " + std::to_string(n));
      add({mesh.of(ends[0]), mesh.of(ends[1])}, false, tie.stiffness);
    }
    for (const Pair &ends : tie.triangles) add(ends, true, tie.stiffness);
    lists.distance = std::max(lists.distance, tie.within);
  }
  return lists;
}

void set_ties(const TieLists &ties, SwMaterialDesc &desc) {
  desc.tie_distance = ties.distance;
  if (ties.ends.empty()) return;
  desc.ties = ties.ends.front().data();
  desc.tie_on_triangles = ties.on_triangles.data();
  desc.tie_stiffness = ties.stiffness.data();
  desc.n_ties = static_cast<uint32_t>(ties.ends.size());
}

}  // namespace cli
