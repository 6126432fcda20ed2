#include "shell.hpp"

#include "choice.hpp"
#include "creases.hpp"
#include "fibres.hpp"
#include "material_maps.hpp"
#include "method.hpp"
#include "progress.hpp"
#include "proxy.hpp"
#include "rim.hpp"
#include "selection.hpp"
#include "shell_model.hpp"
#include "support_motion.hpp"
#include "support_places.hpp"
#include "ties.hpp"
#include "weld.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <stdexcept>

namespace cli {

namespace {

constexpr uint32_t kSupportFields = 24;  // as SwPrecomputeDesc suggests
constexpr uint32_t kModesOfSearch = 8;  // a free shell's six without resistance, and more

bool inside(const Bounds &box, const std::array<double, 3> &x) {
  for (std::size_t k = 0; k < 3; ++k)
    if (!(x[k] >= box.low[k] && x[k] <= box.high[k])) return false;
  return true;
}

std::string describe(const Bounds &box) {
  char text[256];
  std::snprintf(text, sizeof text, "(%g %g %g) to (%g %g %g)", box.low[0], box.low[1], box.low[2], box.high[0],
                box.high[1], box.high[2]);
  return text;
}

std::vector<uint32_t> vertices_inside(const Bounds &box, const Mesh &mesh, const std::string &owner) {
  std::vector<uint32_t> vertices;
  for (uint32_t i = 0; i < mesh.n_vertices(); ++i)
    if (inside(box, mesh.vertex(i))) vertices.push_back(i);
  if (vertices.empty())
    throw std::runtime_error(owner + " box " + describe(box) + " holds no vertex; the mesh lies in " + describe(bounds(mesh)));
  return vertices;
}

void add_vertices(const Support &support, const Mesh &mesh, const std::string &owner, std::vector<uint32_t> &vertices) {
  for (const uint32_t v : support.vertices) vertices.push_back(mesh.of(v));
  for (const std::vector<uint32_t> &more : {!support.side ? std::vector<uint32_t>() : support.rim ? rim_at(*support.side, mesh) : vertices_at(*support.side, mesh),
                                            support.group.empty() ? std::vector<uint32_t>() : vertices_of_group(support.group, mesh)})
    vertices.insert(vertices.end(), more.begin(), more.end());
  if (support.nearest) vertices.push_back(nearest_vertex(*support.nearest, mesh));
  if (!support.box) return;
  const std::vector<uint32_t> boxed = vertices_inside(*support.box, mesh, owner);
  vertices.insert(vertices.end(), boxed.begin(), boxed.end());
}

void remove_repetitions(std::vector<uint32_t> &vertices) {
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
}

// `maps` must outlive what is returned.
std::vector<SwMaterialMap> map_descs(const std::vector<MaterialFile> &maps, const Mesh &mesh) {
  std::vector<SwMaterialMap> descs;
  for (const MaterialFile &map : maps) {
    SwMaterialMap desc = shellwarp::material_map();
    desc.quantity = map.quantity;
    desc.on = map.values.size() == mesh.n_vertices() ? SW_MAP_ON_VERTICES : SW_MAP_ON_TRIANGLES;
    desc.format = SW_FORMAT_F64;
    desc.values = map.values.data();
    desc.count = static_cast<uint32_t>(map.values.size());
    descs.push_back(desc);
  }
  return descs;
}

SwMaterialDesc material_desc(const Material &material) {
  SwMaterialDesc desc = shellwarp::material_desc();
  if (material.sheet) {
    desc.energy = SW_ENERGY_KOITER;
    desc.young = material.young;
    desc.poisson = material.poisson;
    desc.thickness = material.thickness;
    desc.volume_density = material.volume_density;
    desc.young_across = material.young_across;
    desc.shear = material.shear;
    return desc;
  }
  desc.k_area = material.k_area;
  desc.k_length = material.k_length;
  desc.k_bend = material.k_bend;
  desc.area_density = material.density;
  return desc;
}

// The lists must outlive the descriptor.
void set_rest(const CreaseLists &creases, const std::vector<double> &rest, SwMaterialDesc &desc) {
  if (!creases.edges.empty()) {
    desc.creases = creases.edges.front().data();
    desc.n_creases = static_cast<uint32_t>(creases.edges.size());
    desc.crease_factors = creases.factors.data();
    desc.crease_angles = creases.angles.data();
    desc.crease_yields = creases.yields.data();
  }
  if (rest.empty()) return;
  desc.rest_format = SW_FORMAT_F64;
  desc.rest_positions = rest.data();
}

SwSupportDesc support_desc(const SupportVertices &vertices) {
  SwSupportDesc desc = shellwarp::support_desc();
  desc.fixed = vertices.fixed.data();
  desc.n_fixed = static_cast<uint32_t>(vertices.fixed.size());
  desc.clamped = vertices.clamped.data();
  desc.n_clamped = static_cast<uint32_t>(vertices.clamped.size());
  desc.axis_vertices = vertices.along.data();
  desc.axes = vertices.axes.data();
  desc.symmetric_axes = vertices.symmetric.data();
  desc.n_axis_vertices = static_cast<uint32_t>(vertices.along.size());
  return desc;
}

// At the vertices that are simulated.
std::vector<double> damping_factors(const Damping &damping, const Mesh &mesh) {
  if (damping.factors.empty()) return {};
  const std::size_t n = mesh.vertices_of_file();
  if (damping.factors.size() != n)
    throw std::runtime_error(damping.path + ": " + std::to_string(damping.factors.size()) + " factors; the mesh has " + std::to_string(n) + " vertices");
  return mesh.of_file.empty() ? damping.factors : mesh.carried(damping.factors);
}

bool any_needs_fields(const Scene &scene) {
  const std::vector<uint32_t> compared = scene.comparison ? scene.comparison->methods : std::vector<uint32_t>();
  return host::needs_fields(scene.method) || std::any_of(compared.begin(), compared.end(), host::needs_fields);
}

void add_reduced(const Scene &scene, SwPrecomputeDesc &desc) {
  desc.reduced_fields = scene.reduced.fields;
  const bool led = !scene.handles.empty() && !scene.supports.empty();
  if (!desc.reduced_fields && any_needs_fields(scene)) desc.reduced_fields = led ? host::kFieldsWithHandles : host::kFields;
  desc.reduced_elements = scene.reduced.elements;
  desc.reduced_poses = scene.reduced.poses;
  if (!scene.reduced.trained) desc.reduced_flags |= SW_REDUCED_UNTRAINED;
  desc.reduced_gravity = scene.reduced.gravity;
}

// The vertices that handles hold, which `led` keeps: reduced shells want to know them.
void add_handles(const Scene &scene, const Mesh &mesh, std::vector<uint32_t> &led, SwPrecomputeDesc &desc) {
  for (const PlacedHandle &handle : place_handles(scene.handles, mesh)) led.push_back(handle.vertex);
  desc.handles = led.data();
  desc.n_handles = static_cast<uint32_t>(led.size());
}

std::vector<uint32_t> find_patches(const Scene &scene, const Mesh &mesh) {
  const std::size_t n = mesh.vertices_of_file();
  std::vector<uint32_t> patches;
  for (const uint32_t vertex : scene.contact_patches) {
    if (vertex >= n) throw std::runtime_error("contact_patches names vertex " + std::to_string(vertex) + "; the mesh has " + std::to_string(n));
    patches.push_back(mesh.of(vertex));
  }
  remove_repetitions(patches);
  return patches;
}

// Those near the colliders, which are where they stand first, as the shell is.
void add_patches_near(const Scene &scene, const shellwarp::Model &model, std::vector<uint32_t> &patches) {
  if (!scene.patches_near) return;
  std::vector<const SwCollider *> solids;
  std::vector<double> poses;
  for (const Collider &collider : scene.colliders) {
    if (!collider.solid) throw std::logic_error("a collider was not prepared");
    const SwColliderPoseDesc pose = collider.pose(0);
    solids.push_back(collider.solid->get());
    poses.insert(poses.end(), pose.origin, pose.origin + 3);
    poses.insert(poses.end(), pose.rotation, pose.rotation + 9);
  }
  const std::vector<uint32_t> near = model.patches_near(solids, poses, *scene.patches_near, scene.n_patches_near);
  if (near.empty()) throw std::runtime_error("contact_patches_near: no vertex that moves is so near to a collider at the start");
  patches.insert(patches.end(), near.begin(), near.end());
  remove_repetitions(patches);
}

// A choice without a budget needs no trials. For one with a budget, what the scene will do: its gravity, and its handles moved as far as they go.
void add_choice(const Scene &scene, SwPrecomputeDesc &desc) {
  if (!(scene.auto_error > 0) && !(scene.auto_operations > 0)) {
    desc.flags |= SW_PRECOMPUTE_AUTO;
    if (may_be_full(scene) && !scene.is_static && !scene.deterministic) desc.flags |= SW_PRECOMPUTE_AUTO_FULL;
    return;
  }
  desc.auto_error = scene.auto_error;
  desc.auto_operations = scene.auto_operations;
  std::copy(scene.gravity.begin(), scene.gravity.end(), desc.demand_gravity);
  for (const Handle &handle : scene.handles) {
    desc.handle_axes |= handle.axes;
    for (const HandleKey &key : handle.keys)
      desc.handle_distance = std::max(desc.handle_distance, std::hypot(key.offset[0], key.offset[1], key.offset[2]));
  }
}

}  // namespace

std::vector<uint32_t> find_vertices(const Support &support, const Mesh &mesh, const std::string &owner) {
  std::vector<uint32_t> vertices;
  add_vertices(support, mesh, owner, vertices);
  return vertices;
}

SupportVertices find_supports(const Scene &scene, const Mesh &mesh) {
  SupportVertices all;
  for (const Support &support : scene.supports) {
    add_vertices(support, mesh, "support", support.axes ? all.along : support.clamped ? all.clamped : all.fixed);
    all.axes.resize(all.along.size(), static_cast<uint8_t>(support.axes));
    all.symmetric.resize(all.along.size(), static_cast<uint8_t>(support.symmetric ? support.axes : 0));
  }
  remove_repetitions(all.fixed);
  remove_repetitions(all.clamped);
  return all;
}

static bool by_neighbours(const Scene &scene) { return !any_moves(scene) && !scene.material.sheet; }

// What holds the model. On a proxy by the paper's constants the neighbours of what is clamped are those on the file, as a row of the proxy's edges is far wider.
static SupportVertices supports_of(const Scene &scene, const Mesh &mesh) {
  SupportVertices all = find_supports(scene, mesh);
  if (!mesh.proxy || !by_neighbours(scene)) return all;
  all.clamped = host::alone_of(mesh.triangles, mesh.proxy->clamped);
  all.fixed.insert(all.fixed.end(), mesh.proxy->clamped.begin(), mesh.proxy->clamped.end());
  remove_repetitions(all.fixed);
  return all;
}

std::vector<uint32_t> all_of(const SupportVertices &held) {
  std::vector<uint32_t> all = held.fixed;
  all.insert(all.end(), held.clamped.begin(), held.clamped.end());
  all.insert(all.end(), held.along.begin(), held.along.end());
  return all;
}

Mesh scene_mesh(const Scene &scene) {
  Mesh mesh = read_mesh(scene.mesh_path);
  for (double &x : mesh.positions) x *= scene.scale;
  if (scene.proxy.vertices) {
    SupportVertices held = find_supports(scene, mesh);
    if (by_neighbours(scene)) held.clamped = host::with_neighbours(mesh.triangles, held.clamped);
    return make_proxy(mesh, scene.proxy, scene.weld, all_of(held), held.clamped);
  }
  return scene.weld ? weld(mesh, *scene.weld) : mesh;
}

static void scale_stiffness(double factor, Material &material) {
  for (double *stiffness : {&material.k_area, &material.k_length, &material.k_bend}) *stiffness *= factor;
}

// By which the model hangs as far as the scene says: as the full shell does, whatever method the scene takes.
static double factor_of_sag(const Scene &scene, const shellwarp::Model &model) {
  const auto &g = scene.gravity;
  if (g[0] == 0 && g[1] == 0 && g[2] == 0) throw std::runtime_error("--sag (sag) goes with gravity, and there is none: --up, --gravity (gravity)");
  try {
    return host::stiffness_of_sag(model, g, scene.material.sag);
  } catch (const shellwarp::Error &error) {
    throw std::runtime_error("--sag (sag): " + std::string(error.what()));
  }
}

// All stiffnesses by one factor change all frequencies by its root.
Material find_material(const Scene &scene, const Mesh &mesh, ProgressBar &progress) {
  Material material = scene.material;
  if (!material.by_look()) return material;
  const SwMaterialDesc sheet = host::sheet_material({mesh.positions, mesh.triangles}, material.thickness);
  material.k_area = sheet.k_area;
  material.k_length = sheet.k_length;
  material.k_bend = sheet.k_bend;
  Scene probe;
  probe.supports = scene.supports;
  probe.ties = scene.ties;
  probe.material = material;
  probe.scale = scene.scale;  // of a rest shape
  probe.modes = kModesOfSearch;
  probe.method = SW_METHOD_WARP;
  probe.support_fields = 0;
  if (material.sag > 0) {
    scale_stiffness(factor_of_sag(scene, make_model(probe, mesh, progress)), material);
    return material;
  }
  for (const double hertz : make_model(probe, mesh, progress).frequencies()) {
    if (!(hertz > 0)) continue;
    scale_stiffness(material.frequency / hertz * (material.frequency / hertz), material);
    return material;
  }
  throw std::runtime_error("none of the modes swings, so there is no frequency to set: hold some vertices, --weld (weld) pieces that only touch, or give k_bend");
}

// The library names no option of this program.
static shellwarp::Model model_of(const Scene &scene, const Mesh &mesh, const SwMaterialDesc &material, const SwSupportDesc &supports) {
  try {
    return shellwarp::Model(
        shellwarp::mesh_desc(mesh.positions.data(), mesh.n_vertices(), mesh.triangles.data(), mesh.n_triangles()), material, supports);
  } catch (const shellwarp::Error &error) {
    if (std::strstr(error.what(), "each must be shorter than the other two together"))
      throw std::runtime_error(std::string(error.what()) + ": the growth (growth) changes too sharply there; let it fade over several edges, as --growth does and values by vertices can, or take less");
    if (error.status() != SW_ERROR_INVALID_MESH || mesh.proxy) throw;
    throw std::runtime_error(std::string(error.what()) + "; shellwarp check " + scene.mesh_path +
                             " lists all; --proxy 1000 --proxy-cut (proxy, proxy_cut) simulates a mesh made of this one");
  }
}

shellwarp::Model make_model(const Scene &scene, const Mesh &mesh, ProgressBar &progress) {
  const SupportVertices supports = supports_of(scene, mesh);
  const std::vector<MaterialFile> maps = material_maps(scene.material, mesh);
  const std::vector<SwMaterialMap> map_list = map_descs(maps, mesh);
  SwMaterialDesc material = material_desc(scene.material);
  material.metres_per_unit = scene.metres_per_unit;
  material.maps = map_list.data();
  material.n_maps = static_cast<uint32_t>(map_list.size());
  const CreaseLists creases = find_creases(scene.material, mesh);
  const std::vector<double> rest = rest_positions(scene, mesh);
  set_rest(creases, rest, material);
  const std::vector<double> directions = find_directions(scene.material, mesh);
  material.directions = directions.data();
  material.direction_format = SW_FORMAT_F64;
  material.n_directions = static_cast<uint32_t>(directions.size() / 3);
  const TieLists ties = find_ties(scene, mesh);
  set_ties(ties, material);
  shellwarp::Model model = model_of(scene, mesh, material, support_desc(supports));
  if (mesh.proxy && mesh.proxy->calibrates) mesh.proxy->calibrated = calibrate(model, mesh, scene.material.sheet);

  SwPrecomputeDesc desc = shellwarp::precompute_desc();
  desc.modes = scene.modes;
  if (scene.sagged) std::copy(scene.gravity.begin(), scene.gravity.end(), desc.sag_gravity);
  add_reduced(scene, desc);
  desc.support_fields = scene.support_fields.value_or(any_moves(scene) && !scene.follow_rest ? kSupportFields : 0);
  if (desc.support_fields && scene.material.sheet && !supports.clamped.empty())
    throw std::runtime_error(
        "a support that moves needs kind = \"fixed\" of all supports of a sheet: nothing follows the slope at clamped edges; fix two rows of vertices in their place");
  std::vector<uint32_t> patches = find_patches(scene, mesh);
  add_patches_near(scene, model, patches);
  desc.contact_patches = patches.data();
  desc.n_contact_patches = static_cast<uint32_t>(patches.size());
  std::vector<uint32_t> led;
  if (host::needs_choice(scene.method) || any_needs_fields(scene)) add_handles(scene, mesh, led, desc);
  if (host::needs_choice(scene.method)) add_choice(scene, desc);
  desc.precision = scene.double_precision ? SW_PRECISION_F64 : SW_PRECISION_F32;
  progress.attach(desc);
  model.precompute(desc);
  return model;
}

shellwarp::Model make_model(const Scene &scene, const Mesh &mesh, bool quiet) {
  ProgressBar progress(quiet);
  return make_model(scene, mesh, progress);
}

shellwarp::State make_state(const Scene &scene, const Mesh &mesh, const shellwarp::Model &model) {
  SwStateDesc desc = shellwarp::state_desc();
  desc.method = scene.method;
  desc.flags = scene.deterministic ? SW_STATE_DETERMINISTIC : 0;
  desc.integrator = scene.integrator;
  shellwarp::State state(model, desc);
  state.set_gravity(scene.gravity[0], scene.gravity[1], scene.gravity[2]);
  state.set_stiffness(scene.stiffness_factor);
  SwDampingDesc damping = host::damping(scene.damping.ratio, scene.damping.mass, scene.damping.stiffness);
  const std::vector<double> factors = damping_factors(scene.damping, mesh);
  damping.factors = factors.data();
  damping.factor_format = SW_FORMAT_F64;
  damping.n_factors = static_cast<uint32_t>(factors.size());
  state.set_damping(damping);
  set_loads(scene.loads, mesh, state);
  set_colliders(scene.colliders, scene.frame_rate, state);
  return state;
}

}  // namespace cli
