#include "material.hpp"

#include "closest.hpp"
#include "creases.hpp"
#include "fibres.hpp"
#include "material_maps.hpp"
#include "section.hpp"
#include "shellwarp.hpp"

#include <stdexcept>

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

// The sheet of a preset, of the four numbers, or of a preset with some of them in place of its own.
void read_sheet(Section &section, double metres_per_unit, Material &m) {
  const std::optional<std::string> preset = section.text("preset");
  const std::optional<double> young = section.number("young"), poisson = section.number("poisson"),
                              density = section.number("volume_density");
  m.sheet = preset || young || poisson || density;
  if (!m.sheet) return;
  reject_both(section);
  try {
    if (preset) set_preset(*preset, metres_per_unit, m);
  } catch (const std::runtime_error &error) {
    section.fail(*section.find("preset"), error.what());
  }
  for (const char *key : {"young", "poisson", "thickness", "volume_density"})
    if (!preset && !section.find(key))
      section.fail(std::string(key) + " is missing: a sheet needs young, poisson, thickness and volume_density");
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
  m.density = section.number("density").value_or(m.density);
  for (const char *look : {"frequency", "sag"})
    if (section.find(look)) (look[0] == 'f' ? m.frequency : m.sag) = section.positive(look, 0);
  read_sheet(section, metres_per_unit, m);
  m.thickness = section.number("thickness").value_or(m.thickness);
  if (m.frequency > 0 && m.sag > 0) section.fail(*section.find("sag"), "sag and frequency both set the stiffness: give one");
  const char *const look = m.sag > 0 ? "sag" : "frequency";
  if (m.by_look() && (section.find("k_area") || section.find("k_length") || section.find("k_bend")))
    section.fail(*section.find(look), std::string(look) + " sets the stiffness, so k_area, k_length and k_bend must go");
  if (m.thickness < 0) section.fail(*section.find("thickness"), "thickness must not be negative");
  if (m.thickness > 0 && !m.by_look() && !m.sheet)
    section.fail(*section.find("thickness"), "thickness goes with frequency or sag, or with young or preset");
  read_maps(section, m, inputs);
  read_creases(section, m, inputs);
  read_fibres(section, m, inputs);
  section.reject_unknown_keys();
  return m;
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
  throw std::runtime_error("no known material is called '" + name + "'" + did_you_mean(name, preset_list()) + "; there are " + preset_names() +
                           "; others are told by --young, --poisson, --thickness and --volume-density (young and its like)");
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
