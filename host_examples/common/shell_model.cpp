#include "shell_model.hpp"

#include "hash.hpp"
#include "message.hpp"
#include "shell_parts.hpp"
#include "support_places.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace host {

namespace {

Vec3 point(const Mesh &mesh, uint32_t i) {
  const double *x = &mesh.points[3 * std::size_t(i)];
  return {x[0], x[1], x[2]};
}

double distance(const Vec3 &a, const Vec3 &b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

double mean_edge(const Mesh &mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); t += 3)
    for (std::size_t k = 0; k < 3; ++k)
      sum += distance(point(mesh, mesh.triangles[t + k]), point(mesh, mesh.triangles[t + (k + 1) % 3]));
  return sum / static_cast<double>(mesh.triangles.size());
}

double size_of(const Mesh &mesh) {
  Vec3 low = point(mesh, 0), high = low;
  for (uint32_t i = 1; i < mesh.n_points(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], point(mesh, i)[k]);
      high[k] = std::max(high[k], point(mesh, i)[k]);
    }
  return distance(low, high);
}

void set_fibres(const Stiffness &s, SwMaterialDesc &desc) {
  if (s.young_across > 0) desc.young_across = s.young_across * s.metres, desc.shear = s.shear * s.metres;
}

// A sheet in the object's unit of length, kilograms and seconds.
SwMaterialDesc real_material(const Stiffness &s) {
  if (s.by == Stiffness::By::preset) {
    SwMaterialDesc known = shellwarp::preset_material(s.preset, s.metres);
    known.metres_per_unit = s.metres;
    if (s.thickness > 0) known.thickness = s.thickness;
    set_fibres(s, known);
    return known;
  }
  SwMaterialDesc desc = shellwarp::material_desc();
  desc.energy = SW_ENERGY_KOITER;
  desc.young = s.young * s.metres;
  desc.poisson = s.poisson;
  desc.thickness = s.thickness;
  desc.volume_density = s.volume_density * s.metres * s.metres * s.metres;
  desc.metres_per_unit = s.metres;
  set_fibres(s, desc);
  return desc;
}

SwMaterialDesc material(const Mesh &mesh, const Stiffness &stiffness) {
  if (stiffness.by_look()) return sheet_material(mesh, stiffness.thickness);
  if (stiffness.by_sheet()) return real_material(stiffness);
  SwMaterialDesc desc = shellwarp::material_desc();
  desc.k_bend = stiffness.bend;
  desc.k_area = desc.k_length = stiffness.stretch;
  desc.area_density = stiffness.density;
  return desc;
}

// A constant times a factor at each vertex.
struct ScaledMap {
  std::vector<double> values;
  SwMaterialMap map{};

  ScaledMap(uint32_t quantity, double constant, const std::vector<double> &factors) : values(factors) {
    for (double &x : values) x *= constant;
    sw_material_map_init(&map);
    map.quantity = quantity, map.on = SW_MAP_ON_VERTICES, map.format = SW_FORMAT_F64;
    map.values = values.data(), map.count = static_cast<uint32_t>(values.size());
  }
};

std::vector<ScaledMap> maps_of(const Stiffness &s, const SwMaterialDesc &desc) {
  std::vector<ScaledMap> maps;
  const auto add = [&maps](uint32_t quantity, double constant, const std::vector<double> &factors) {
    if (!factors.empty()) maps.emplace_back(quantity, constant, factors);
  };
  add(SW_MAP_GROWTH, 1, s.growth_map);
  if (s.by_sheet()) {
    add(SW_MAP_THICKNESS, desc.thickness, s.thickness_map);
    add(SW_MAP_YOUNG, desc.young, s.young_map);
    add(SW_MAP_VOLUME_DENSITY, desc.volume_density, s.density_map);
    return maps;
  }
  add(SW_MAP_AREA_DENSITY, desc.area_density, s.density_map);
  if (s.by_look()) return maps;
  add(SW_MAP_K_BEND, desc.k_bend, s.bend_map);
  add(SW_MAP_K_LENGTH, desc.k_length, s.stretch_map);
  add(SW_MAP_K_AREA, desc.k_area, s.stretch_map);
  return maps;
}

shellwarp::Model make_model(const Mesh &mesh, const Build &build) {
  SwSupportDesc supports = shellwarp::support_desc();
  const std::vector<uint32_t> clamped = held_with_neighbours(mesh, build);
  supports.clamped = clamped.data(), supports.n_clamped = static_cast<uint32_t>(clamped.size());
  supports.fixed = build.held.data();
  supports.n_fixed = clamped.size() == build.held.size() ? 0 : static_cast<uint32_t>(build.held.size());
  SwMaterialDesc desc = material(mesh, build.stiffness);
  std::vector<ScaledMap> scaled = maps_of(build.stiffness, desc);
  std::vector<SwMaterialMap> maps;
  for (ScaledMap &one : scaled) one.map.values = one.values.data(), maps.push_back(one.map);
  desc.maps = maps.empty() ? nullptr : maps.data();
  desc.n_maps = static_cast<uint32_t>(maps.size());
  const ShellParts parts(mesh, build);
  parts.put(desc, supports);
  return shellwarp::Model(
      shellwarp::mesh_desc(mesh.points.data(), mesh.n_points(), mesh.triangles.data(), mesh.n_triangles()), desc, supports);
}

}  // namespace

bool UntilInterrupted::operator()(double) const noexcept {
  try {
    return !interrupted_ || !interrupted_();
  } catch (...) {
    return false;  // a host that cannot even be asked is not kept waiting
  }
}

std::vector<uint32_t> patches_near(Mesh mesh, const Build &build, const std::vector<const SwCollider *> &solids, const std::vector<double> &poses, double distance) {
  mesh.cut();
  return make_model(mesh, build).patches_near(solids, poses, distance, build.most_patches);
}

namespace {

struct Listener {
  const std::function<bool()> &interrupted;
  const std::function<void(uint32_t, double)> &progress;
};

uint32_t report_progress(void *user, uint32_t phase, double fraction) noexcept {
  try {
    const Listener &listener = *static_cast<const Listener *>(user);
    if (listener.progress) listener.progress(phase, fraction);
    return UntilInterrupted(listener.interrupted)(fraction) ? SW_PROGRESS_CONTINUE : SW_PROGRESS_CANCEL;
  } catch (...) {
    return SW_PROGRESS_CANCEL;  // nor is one that cannot be told
  }
}

// A choice without trials.
bool chosen_unasked(const Build &build) { return needs_choice(build.method) && !(build.auto_error > 0); }

SwPrecomputeDesc precompute_desc(const Build &build) {
  SwPrecomputeDesc desc = shellwarp::precompute_desc();
  desc.modes = build.modes;
  desc.precision = build.double_precision ? SW_PRECISION_F64 : SW_PRECISION_F32;
  if (needs_fields(build.method) || chosen_unasked(build)) desc.reduced_fields = build.reduced_fields;
  if (chosen_unasked(build)) desc.flags |= SW_PRECOMPUTE_AUTO | SW_PRECOMPUTE_AUTO_FULL;
  if (follows_by_fields(build.method)) desc.support_fields = build.support_fields;
  desc.contact_patches = build.contact_patches.data();
  desc.n_contact_patches = static_cast<uint32_t>(build.contact_patches.size());
  return desc;
}

// The model for the choice: for gravity in any direction, since the object may turn, and so of the shape that came in.
SwPrecomputeDesc choice_desc(const Build &build, double gravity) {
  SwPrecomputeDesc desc = precompute_desc(build);
  desc.reduced_fields = build.reduced_fields;
  desc.auto_error = build.auto_error;
  desc.demand_acceleration = gravity;
  return desc;
}

void precompute(shellwarp::Model &model, SwPrecomputeDesc desc, const Listener &listener) {
  if (listener.interrupted || listener.progress) {
    desc.progress = report_progress;
    desc.progress_user = const_cast<Listener *>(&listener);
  }
  try {
    model.precompute(desc);
  } catch (const shellwarp::Error &error) {
    if (error.status() == SW_ERROR_CANCELLED) throw Interrupted();
    throw;
  }
}

// Why it could not be, or nothing.
std::string calibrate(shellwarp::Model &model, const Build &build, const Listener &listener) {
  if (!build.proxy) return "";
  if (build.held.empty() && build.axis_supports.empty()) return "nothing holds it";
  SwCalibrationDesc desc = shellwarp::calibration_desc();
  if (listener.interrupted) {
    desc.progress = report_progress;
    desc.progress_user = const_cast<Listener *>(&listener);
  }
  try {
    model.calibrate(*build.proxy, desc);
    return "";
  } catch (const shellwarp::Error &error) {
    if (error.status() == SW_ERROR_CANCELLED) throw Interrupted();
    if (error.status() == SW_ERROR_OUT_OF_MEMORY) throw;
    return error.what();
  }
}

void require(bool good, const char *name, double value, const char *range) {
  if (!good) throw HostError(std::string(name) + " is " + number(value) + "; it must be " + range);
}

void require_method(uint32_t method) {
  if (*sw_method_name(method)) return;
  std::string names;
  for (const uint32_t known : methods())
    names += (names.empty() ? "" : ", ") + number(uint64_t(known)) + " " + method_name(known);
  throw HostError("the method is number " + number(uint64_t(method)) + ", which this library does not have; it has " +
                  names);
}

void require_positive(const char *name, double value) {
  require(value > 0 && value <= std::numeric_limits<double>::max(), name, value, "above 0");
}

void check_stiffness(const Stiffness &s) {
  if (s.by == Stiffness::By::frequency) require_positive("the frequency", s.frequency);
  if (s.by == Stiffness::By::sag) require_positive("the sag", s.sag);
  if (s.by_look() || s.by == Stiffness::By::preset)
    require(s.thickness >= 0 && std::isfinite(s.thickness), "the thickness", s.thickness, "0 or above");
  if (s.by == Stiffness::By::material) {
    require_positive("the bend stiffness", s.bend);
    require_positive("the stretch stiffness", s.stretch);
    require_positive("the density", s.density);
  }
  if (s.by == Stiffness::By::preset && s.preset >= sw_preset_count())
    throw HostError("the known material is number " + number(uint64_t(s.preset)) + ", but this library has " +
                    number(uint64_t(sw_preset_count())));
  if (s.by_sheet()) {
    require_positive("the number of metres in a unit", s.metres);
    require(s.young_across >= 0 && std::isfinite(s.young_across), "Young's modulus across", s.young_across, "0 or above");
    require(s.shear >= 0 && std::isfinite(s.shear), "the shear modulus", s.shear, "0 or above");
  }
  if (s.by == Stiffness::By::sheet) {
    require_positive("Young's modulus", s.young);
    require(s.poisson > -1 && s.poisson <= 0.5, "Poisson's ratio", s.poisson, "above -1 and at most 0.5");
    require_positive("the thickness of a sheet", s.thickness);
    require_positive("the density by volume", s.volume_density);
  }
}

}  // namespace

SwMaterialDesc sheet_material(const Mesh &mesh, double thickness) {
  const double h = thickness > 0 ? thickness : size_of(mesh) / 200;
  SwMaterialDesc desc = shellwarp::material_desc();
  desc.k_length = std::sqrt(3.0) / 4 * mean_edge(mesh);
  desc.k_area = 0.5;
  desc.k_bend = h * h / 64;
  desc.area_density = 1;
  return desc;
}

static constexpr double kSagTolerance = 1e-3;  // of the length
static constexpr double kSheet = 0.2;  // kg/m2, which is 1 by frequency and sag

std::string unused_maps(const Stiffness &s) {
  std::string names;
  const auto look = [&names](bool taken, const char *name, const std::vector<double> &map) {
    const bool varies = std::any_of(map.begin(), map.end(), [](double x) { return x != 1; });
    if (!taken && varies) names += (names.empty() ? "" : ", ") + std::string(name);
  };
  const bool by_material = s.by == Stiffness::By::material;
  look(s.by_sheet(), "thickness", s.thickness_map);
  look(s.by_sheet(), "Young's modulus", s.young_map);
  look(by_material, "bending", s.bend_map);
  look(by_material, "stretching", s.stretch_map);
  return names;
}

double force_scale(const Stiffness &stiffness) {
  const double metres = stiffness.metres;
  if (stiffness.by_look()) return 1 / (kSheet * metres * metres * metres);
  return stiffness.by == Stiffness::By::material ? 1 : 1 / metres;
}

double air_density(const Stiffness &stiffness, double density) {
  const double metres = stiffness.metres;
  if (stiffness.by_look()) return density * metres / kSheet;
  return stiffness.by == Stiffness::By::material ? density : density * metres * metres * metres;
}

ShellModel::ShellModel(const Mesh &mesh, const Build &build, double gravity, const std::function<bool()> &interrupted,
                       const std::function<void(uint32_t, double)> &progress)
    : rest_(mesh.points), floats_(build.held.empty() && build.axis_supports.empty()), model_(make_model(mesh, build)) {
  const Listener listener{interrupted, progress};
  uncalibrated_ = calibrate(model_, build, listener);
  precompute(model_, precompute_desc(build), listener);
  find_slowest();
  if (needs_choice(build.method) && !chosen_unasked(build)) {
    const double seconds = clock(build.stiffness);
    precompute(model_, choice_desc(build, gravity / (seconds * seconds)), listener);
  }
  shellwarp::check(sw_model_offers(model_.get(), build.method));
}

ShellModel::ShellModel(std::vector<double> rest, bool held, const std::vector<unsigned char> &saved)
    : rest_(std::move(rest)), floats_(!held), model_(shellwarp::Model::load(saved)) {
  find_slowest();
}

void ShellModel::find_slowest() {
  for (const double hertz : model_.frequencies())
    if (hertz > 0) {
      slowest_ = hertz;
      break;
    }
}

// A clamped strip sags by 12.36/8 of g/ω². Under gravity over a stiffness of that kind the search begins near the end, and within its range.
double stiffness_of_sag(const shellwarp::Model &model, const Vec3 &gravity, double sag) {
  double hertz = 0;
  for (const double found : model.frequencies())
    if (found > 0) {
      hertz = found;
      break;
    }
  const double omega = 2 * 3.14159265358979323846 * hertz;
  const double first = hertz > 0 ? 1.545 * std::hypot(gravity[0], gravity[1], gravity[2]) / (omega * omega * sag) : 1;
  SwStateDesc desc = shellwarp::state_desc();
  desc.method = SW_METHOD_SHELL_IMPLICIT;
  shellwarp::State state(model, desc);
  state.set_gravity(gravity[0] / first, gravity[1] / first, gravity[2] / first);
  return first * state.set_sag(sag, kSagTolerance);
}

// With the clock c the scene's gravity g is g/c² in the library's seconds, and so is the load over a stiffness of c².
double ShellModel::clock_of_sag(const Stiffness &stiffness) const {
  if (sag_ && sag_->length == stiffness.sag && sag_->gravity == stiffness.sag_gravity) return sag_->clock;
  const Vec3 &g = stiffness.sag_gravity;
  if (g == Vec3{}) throw HostError("the stiffness is by sag, and there is no gravity");
  const double clock = std::sqrt(stiffness_of_sag(model_, g, stiffness.sag));
  sag_ = Sag{stiffness.sag, g, clock};
  return clock;
}

double ShellModel::clock(const Stiffness &stiffness) const {
  if (stiffness.by == Stiffness::By::sag) return clock_of_sag(stiffness);
  if (stiffness.by != Stiffness::By::frequency) return 1;
  if (!(slowest_ > 0))
    throw HostError(
        "none of the modes swings, so there is no frequency to set: ask for more modes, hold more vertices, "
        "or set the stiffness by material");
  return stiffness.frequency / slowest_;
}

uint64_t build_key(const Mesh &mesh, const Build &build) {
  Hash hash;
  hash.add(mesh.n_points()).add_all(mesh.faces()).add_all(mesh.sizes).add_all(build.held).add_all(build.contact_patches);
  hash.add(build.clamped).add(build.modes).add(build.double_precision).add(build.stiffness.by);
  const bool fields = needs_fields(build.method), choice = needs_choice(build.method);
  hash.add(fields).add(choice).add(fields || choice ? build.reduced_fields : 0).add(choice ? build.auto_error : 0.0);
  hash.add(follows_by_fields(build.method) ? build.support_fields : 0);
  for (const Crease &crease : build.creases)
    hash.add(crease.a).add(crease.b).add(crease.factor).add(crease.angle.has_value()).add(crease.angle.value_or(0)).add(crease.yield);
  hash.add(build.creases.size()).add_all(build.rest_shape);
  for (const AxisSupport &support : build.axis_supports) hash.add(support.vertex).add(support.axes).add(support.symmetric);
  for (const Tie &tie : build.ties) hash.add(tie.vertex).add(tie.to).add(tie.to_face).add(tie.stiffness);
  hash.add(build.axis_supports.size()).add(build.ties.size()).add(build.tie_within).add(build.proxy != nullptr);
  const Stiffness &s = build.stiffness;
  hash.add_all(s.density_map).add_all(s.growth_map);
  if (s.by_look()) return hash.add(s.thickness).value();
  if (s.by_sheet()) {
    hash.add_all(s.thickness_map).add_all(s.young_map).add(s.young_across);
    if (s.young_across > 0) hash.add(s.shear).add_all(s.directions);
  }
  if (s.by == Stiffness::By::preset) return hash.add(s.preset).add(s.thickness).add(s.metres).value();
  if (s.by == Stiffness::By::sheet)
    return hash.add(s.young).add(s.poisson).add(s.thickness).add(s.volume_density).add(s.metres).value();
  return hash.add(s.bend).add(s.stretch).add(s.density).add_all(s.bend_map).add_all(s.stretch_map).value();
}

void check_map(const Mesh &mesh, const char *what, const std::vector<double> &factors, bool zero_too) {
  if (factors.empty()) return;
  if (factors.size() != mesh.n_points())
    throw HostError(std::string("the map of the ") + what + " has " + number(uint64_t(factors.size())) + " values, the simulated mesh " +
                    number(uint64_t(mesh.n_points())) + " points");
  for (std::size_t i = 0; i < factors.size(); ++i)
    if (!(factors[i] > 0 || (zero_too && factors[i] == 0)) || !std::isfinite(factors[i]))
      throw HostError(std::string("the map of the ") + what + " is " + number(factors[i]) + " at point " + number(uint64_t(i)) +
                      (zero_too ? "; it must be 0 or above" : "; it must be above 0"));
}

void check_build(const Mesh &mesh, const Build &build) {
  if (mesh.points.empty() || mesh.faces().empty())
    throw HostError("there is no surface: " + number(uint64_t(mesh.n_points())) + " points, " +
                    number(uint64_t(mesh.n_triangles())) + " triangles");
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (mesh.triangles[i] >= mesh.n_points())
      throw HostError("triangle " + number(uint64_t(i / 3)) + " names vertex " + number(uint64_t(mesh.triangles[i])) +
                      ", but there are " + number(uint64_t(mesh.n_points())));
  for (const uint32_t i : mesh.corners)
    if (i >= mesh.n_points())
      throw HostError("a polygon names vertex " + number(uint64_t(i)) + ", but there are " +
                      number(uint64_t(mesh.n_points())));
  require(build.modes >= 1 && build.modes <= 1024, "the number of modes", build.modes, "1 to 1024");
  require_method(build.method);
  require(build.reduced_fields >= 1, "the number of reduced fields", build.reduced_fields, "1 or above");
  require(build.auto_error >= 0 && std::isfinite(build.auto_error), "the error of the automatic choice",
          build.auto_error, "0 or above");
  require(build.patches_near >= 0 && std::isfinite(build.patches_near), "the distance of contact patches", build.patches_near, "0 or above");
  require(build.most_patches >= 1 && build.most_patches <= 128, "the most contact patches", build.most_patches, "1 to 128");
  check_stiffness(build.stiffness);
  const Stiffness &s = build.stiffness;
  check_map(mesh, "density", s.density_map);
  check_map(mesh, "growth", s.growth_map);
  if (s.by_sheet()) check_map(mesh, "thickness", s.thickness_map), check_map(mesh, "Young's modulus", s.young_map);
  if (s.by == Stiffness::By::material) check_map(mesh, "bending", s.bend_map), check_map(mesh, "stretching", s.stretch_map);
}

}  // namespace host
