#include "material.hpp"

#include "closest.hpp"
#include "creases.hpp"
#include "fibres.hpp"
#include "material_maps.hpp"
#include "section.hpp"
#include "shellwarp.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <utility>

namespace cli {

namespace {

constexpr const char *kConstants[] = {"k_area", "k_length", "k_bend", "density", "frequency", "sag"};
constexpr const char *kSheet[] = {"preset", "young", "poisson", "volume_density", "young_across"};

void reject_both(Section &section) {
  for (const char *sheet : kSheet)
    for (const char *constant : kConstants)
      if (section.find(sheet) && section.find(constant))
        section.fail(*section.find(constant), std::string(constant) + " does not go with " + sheet +
                                                  ": a sheet has young, poisson, thickness and volume_density");
}

std::optional<double> positive(Section &section, const char *key) {
  if (!section.find(key)) return std::nullopt;
  return section.positive(key, 0);
}

// Fails where the numbers leave something open, or nothing to resist anything. What a map has need not be there besides.
void check_complete(Section &section, const Material &m) {
  const auto varies = [&m](uint32_t quantity) {
    return std::any_of(m.files.begin(), m.files.end(), [quantity](const MaterialFile &map) { return map.quantity == quantity; });
  };
  const std::pair<const char *, uint32_t> needed[] = {
      {"young", SW_MAP_YOUNG}, {"poisson", 0}, {"thickness", SW_MAP_THICKNESS}, {"volume_density", SW_MAP_VOLUME_DENSITY}};
  for (const auto &[key, map] : needed)
    if (m.sheet && !section.find("preset") && !section.find(key) && !varies(map))
      section.fail(std::string(key) + " is missing: a sheet needs young, poisson, thickness and volume_density");
  if (m.young_across > 0 && !(m.young > 0)) section.fail("young must be given beside young_across, with a map, too");
  if (m.thickness > 0 && !m.by_look() && !m.sheet)
    section.fail(*section.find("thickness"), "thickness goes with frequency or sag, or with young or preset");
  if (const std::string none = resists_nothing(m); !none.empty()) section.fail(*section.find("k_bend"), none);
}

// The sheet of a preset, of the four numbers, or of a preset with some of them in place of its own.
void read_sheet(Section &section, double metres_per_unit, Material &m) {
  const std::optional<std::string> preset = section.text("preset");
  const std::optional<double> young = positive(section, "young"), poisson = section.number("poisson"),
                              density = positive(section, "volume_density");
  m.sheet = preset || young || poisson || density;
  if (!m.sheet) return;
  reject_both(section);
  if (poisson && !(*poisson > -1 && *poisson <= 0.5)) section.fail(*section.find("poisson"), "poisson must be above -1 and at most 0.5");
  try {
    if (preset) set_preset(*preset, metres_per_unit, m);
  } catch (const std::runtime_error &error) {
    section.fail(*section.find("preset"), error.what());
  }
  m.young = young.value_or(m.young);
  m.poisson = poisson.value_or(m.poisson);
  m.volume_density = density.value_or(m.volume_density);
}

}  // namespace

Material read_material(Section section, double metres_per_unit, std::vector<std::string> &inputs) {
  Material m;
  m.k_area = section.number("k_area").value_or(m.k_area);
  m.k_length = section.number("k_length").value_or(m.k_length);
  m.k_bend = section.number("k_bend").value_or(m.k_bend);
  m.density = positive(section, "density").value_or(m.density);
  for (const char *look : {"frequency", "sag"})
    if (section.find(look)) (look[0] == 'f' ? m.frequency : m.sag) = section.positive(look, 0);
  read_sheet(section, metres_per_unit, m);
  m.thickness = positive(section, "thickness").value_or(m.thickness);
  if (m.frequency > 0 && m.sag > 0) section.fail(*section.find("sag"), "sag and frequency both set the stiffness: give one");
  const char *const look = m.sag > 0 ? "sag" : "frequency";
  if (m.by_look() && (section.find("k_area") || section.find("k_length") || section.find("k_bend")))
    section.fail(*section.find(look), std::string(look) + " sets the stiffness, so k_area, k_length and k_bend must go");
  read_maps(section, m, inputs);
  read_creases(section, m, inputs);
  read_fibres(section, m, inputs);
  section.reject_unknown_keys();  // before what is missing: it may be misspelt
  check_complete(section, m);
  return m;
}

std::string resists_nothing(const Material &m) {
  if (m.sheet || m.by_look() || m.k_area != 0 || m.k_length != 0 || m.k_bend != 0) return "";
  return "k_area, k_length and k_bend are all 0, so that nothing resists anything: give one, or leave all out for the defaults";
}

void set_preset(const std::string &name, double metres_per_unit, Material &material) {
  for (uint32_t i = 0; i < sw_preset_count(); ++i) {
    if (name != sw_preset_name(i)) continue;
    const SwMaterialDesc known = shellwarp::preset_material(i, metres_per_unit);
    material.sheet = true;
    material.young = known.young;
    material.poisson = known.poisson;
    material.thickness = known.thickness;
    material.volume_density = known.volume_density;
    return;
  }
  throw std::runtime_error("no known material is called '" + name + "'; there are " + preset_names() +
                           "; others are told by --young, --poisson, --thickness and --volume-density (young and its like)" +
                           did_you_mean(name, preset_list()));
}

std::vector<std::string> preset_list() {
  std::vector<std::string> names;
  for (uint32_t i = 0; i < sw_preset_count(); ++i) names.emplace_back(sw_preset_name(i));
  return names;
}

std::string preset_names() {
  std::string names;
  for (uint32_t i = 0; i < sw_preset_count(); ++i) names += (i ? ", " : "") + std::string(sw_preset_name(i));
  return names;
}

}  // namespace cli
