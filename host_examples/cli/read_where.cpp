#include "read_where.hpp"

#include "section.hpp"
#include "selection.hpp"

namespace cli {

std::vector<uint32_t> read_indices(Section &section, const char *key) {
  std::vector<uint32_t> indices;
  const toml::node *node = section.find(key);
  const toml::array *array = node ? node->as_array() : nullptr;
  for (std::size_t i = 0; array && i < array->size(); ++i)
    if (const std::optional<uint32_t> index = (*array)[i].value<uint32_t>()) indices.push_back(*index);
  if (node && (!array || indices.size() != array->size()))
    section.fail(*node, std::string(key) + " must be a list of vertex indices, counted from 0");
  return indices;
}

std::optional<Side> read_side(Section &section) {
  const std::optional<std::string> word = section.text("side");
  const std::optional<Side> side = word ? find_side(*word) : std::nullopt;
  if (word && !side) section.choice("side", side_names());  // says what it must be
  return side;
}

Support read_where(Section &section, std::vector<std::string> &inputs) {
  Support support;
  const std::vector<double> b = section.numbers("box", 6);
  if (!b.empty()) support.box = Bounds{{b[0], b[1], b[2]}, {b[3], b[4], b[5]}};
  support.vertices = read_indices(section, "vertices");
  support.side = read_side(section);
  support.group = section.text("group").value_or("");
  if (const auto file = section.file("list")) {
    inputs.push_back(*file);
    support.vertices = read_vertex_list(inputs.back());
  }
  if (!support.box && support.vertices.empty() && !support.side && support.group.empty())
    section.fail("name the vertices by side, box, vertices, list or group");
  return support;
}

}  // namespace cli
