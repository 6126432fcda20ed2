#include "proxy.hpp"

#include "nearest.hpp"
#include "output_file.hpp"
#include "scene.hpp"
#include "selection.hpp"
#include "shell.hpp"
#include "shell_parts.hpp"
#include "watch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace cli {

namespace {

constexpr uint32_t kCompared = 10;       // frequencies
constexpr uint32_t kMost = 100000;       // vertices of a file whose frequencies are looked for
constexpr double kFar = 0.1;             // off under gravity after a calibration: to be seen
constexpr double kThinness = 1.0 / 200;  // of the size: any sheet would do, as frequencies are compared

SwProxyDesc proxy_desc_of(const ProxyOptions &options, std::optional<double> weld) {
  SwProxyDesc desc = shellwarp::proxy_desc();
  desc.n_vertices = options.vertices;
  desc.weld = weld.value_or(0);
  desc.thickness = options.thickness.value_or(0);
  if (options.thickness && !(*options.thickness > 0)) desc.flags |= SW_PROXY_KEEP_SIDES;
  if (options.cut) desc.flags |= SW_PROXY_CUT;
  return desc;
}

SwMeshDesc desc_of(const Mesh &mesh) {
  return shellwarp::mesh_desc(mesh.positions.data(), mesh.n_vertices(), mesh.triangles.data(), mesh.n_triangles());
}

// The library names no option of this program.
shellwarp::Proxy proxy_of(const Mesh &file, const SwProxyDesc &desc) {
  try {
    return shellwarp::Proxy(desc_of(file), desc);
  } catch (const shellwarp::Error &error) {
    if (error.status() != SW_ERROR_INVALID_MESH || (desc.flags & SW_PROXY_CUT) || !std::strstr(error.what(), "let the proxy be cut")) throw;
    throw std::runtime_error(std::string(error.what()) + ": --proxy-cut (proxy_cut)");
  }
}

// Those of which at least half is the group's; of a group that is smaller than that, the nearest ones.
std::set<uint32_t> carried_group(const std::set<uint32_t> &group, const Mesh &proxy) {
  std::set<uint32_t> carried;
  for (uint32_t v = 0; v < proxy.n_vertices(); ++v) {
    double share = 0;
    for (std::size_t k = 0; k < 3; ++k)
      if (group.count(proxy.proxy->sources[3 * std::size_t{v} + k])) share += proxy.proxy->weights[3 * std::size_t{v} + k];
    if (share >= 0.5) carried.insert(v);
  }
  if (carried.empty())
    for (const uint32_t v : group) carried.insert(proxy.of(v));
  return carried;
}

std::vector<double> frequencies_of(const Mesh &mesh, const std::vector<Support> &supports, std::string *told = nullptr) {
  Scene scene;
  scene.supports = supports;
  const SupportVertices held = find_supports(scene, mesh);
  const Bounds box = bounds(mesh);
  SwMaterialDesc sheet = shellwarp::material_desc();
  sheet.energy = SW_ENERGY_KOITER;
  sheet.young = 1e6, sheet.poisson = 0.3, sheet.volume_density = 1000;
  sheet.thickness = kThinness * std::hypot(box.high[0] - box.low[0], box.high[1] - box.low[1], box.high[2] - box.low[2]);
  SwSupportDesc fixed = shellwarp::support_desc();
  fixed.fixed = held.fixed.data(), fixed.n_fixed = static_cast<uint32_t>(held.fixed.size());
  fixed.clamped = held.clamped.data(), fixed.n_clamped = static_cast<uint32_t>(held.clamped.size());
  shellwarp::Model model(desc_of(mesh), sheet, fixed);
  if (told) *told = calibrate(model, mesh, true);
  SwPrecomputeDesc desc = shellwarp::precompute_desc();
  desc.modes = kCompared + 6;  // and a free shell's six of no frequency
  desc.flags = SW_PRECOMPUTE_LINEAR;
  model.precompute(desc);
  std::vector<double> hertz = model.frequencies();
  hertz.erase(std::remove_if(hertz.begin(), hertz.end(), [](double f) { return !(f > 0); }), hertz.end());
  hertz.resize(std::min<std::size_t>(hertz.size(), kCompared));
  return hertz;
}

void tell_frequencies(const std::string &path, const Mesh &file, const Mesh &proxy, const std::vector<Support> &supports) {
  if (file.n_vertices() > kMost) {
    std::printf("frequencies: not compared, as a mesh of %u vertices would take long\n", file.n_vertices());
    return;
  }
  std::vector<double> own, other;
  try {
    const Watch watch("finding frequencies of both", false);
    own = frequencies_of(file, supports);
    other = frequencies_of(proxy, supports);
  } catch (const shellwarp::Error &error) {
    std::printf("frequencies: not compared, as %s is no shell: %s\n", path.c_str(), error.what());
    return;
  }
  const auto compare = [&own](const char *what, const std::vector<double> &other) {
    const std::size_t n = std::min(own.size(), other.size());
    double worst = 0;
    std::printf("frequencies of a sheet, %s against file, %%:", what);
    for (std::size_t k = 0; k < n; ++k) {
      const double off = 100 * (other[k] / own[k] - 1);
      worst = std::max(worst, std::fabs(off));
      std::printf(" %+.2f", off);
    }
    std::printf("\nthe first %zu frequencies are off by at most %.2g %%\n", n, worst);
  };
  compare("proxy", other);
  if (!proxy.proxy->calibrates || supports.empty()) return;
  std::string told;
  const std::vector<double> fitted = frequencies_of(proxy, supports, &told);
  std::printf("%s\n", told.c_str());
  compare("calibrated proxy", fitted);
}

}  // namespace

Mesh make_proxy(const Mesh &file, const ProxyOptions &options, std::optional<double> weld, const std::vector<uint32_t> &held, const std::vector<uint32_t> &clamped) {
  SwProxyDesc desc = proxy_desc_of(options, weld);
  desc.held = held.data(), desc.n_held = static_cast<uint32_t>(held.size());
  const auto kept = std::make_shared<const shellwarp::Proxy>(proxy_of(file, desc));
  const shellwarp::Proxy &made = *kept;
  Mesh mesh;
  mesh.positions = made.positions();
  mesh.triangles = made.triangles();
  mesh.of_file = made.nearest();
  auto from = std::make_shared<ProxySource>();
  made.sources(from->sources, from->weights);
  from->file_positions = file.positions;
  mesh.n_file_triangles = file.n_triangles();
  mesh.file_triangles = host::nearest_of(host::middles_of({file.positions, file.triangles}), host::middles_of({mesh.positions, mesh.triangles}));
  from->info = made.info();
  from->made = kept;
  from->calibrates = options.calibrated;
  for (const uint32_t v : clamped) from->clamped.push_back(mesh.of_file[v]);
  mesh.proxy = from;
  for (const auto &[name, vertices] : file.groups) mesh.groups[name] = carried_group(vertices, mesh);
  return mesh;
}

std::string describe_proxy(const SwProxyInfo &info) {
  char text[512];
  std::snprintf(text, sizeof text, "%u vertices and %u triangles stand for %u vertices; edges are %.3g long, the furthest vertex is %.3g away", info.n_vertices,
                info.n_triangles, info.n_asset_vertices, info.edge_length, info.furthest_distance);
  std::string told = text;
  const auto add = [&](uint32_t count, const char *words) {
    if (count) told += "; " + std::to_string(count) + words;
  };
  if (info.n_sides_joined) {
    std::snprintf(text, sizeof text, "; two sides %.3g apart are one sheet", info.thickness);
    told += text;
  }
  add(info.n_welded, " vertices are welded");
  add(info.n_repeated, " triangles that repeat others are left out");
  add(info.n_left_out, " small pieces are left out and follow");
  add(info.n_holes_closed, " small holes are closed");
  add(info.n_cut, " places are cut and may part");
  if (info.n_pieces > 1) add(info.n_pieces, " pieces do not hang together");
  return told;
}

// Of per cent: two, or as many as there are before the point.
static int digits(double share) { return share < 0.995 ? 2 : 3 + static_cast<int>(std::log10(share)); }

std::string calibrate(shellwarp::Model &model, const Mesh &mesh, bool is_sheet) {
  try {
    const SwCalibrationInfo found = model.calibrate(*mesh.proxy->made);
    char text[256];
    std::snprintf(text, sizeof text, "calibrated on %u vertices: under gravity the proxy was %.*g %% off, now %.*g %%; stretching by %.2f to %.2f, bending by %.2f to %.2f",
                  found.n_compared, digits(found.difference_before), 100 * found.difference_before, digits(found.difference_after), 100 * found.difference_after, found.stretching_min, found.stretching_max, found.bending_min,
                  found.bending_max);
    mesh.proxy->difference = found.difference_after;
    if (found.difference_after <= kFar) return text;
    const std::string far = std::string(text) + "; still far off: take more vertices, hold a wider part";
    return is_sheet ? far + ", or simulate the file itself" : far + ", or name a sheet (--material, --young; material.preset, young)";
  } catch (const shellwarp::Error &error) {
    if (error.status() == SW_ERROR_CANCELLED || error.status() == SW_ERROR_OUT_OF_MEMORY) throw;
    return std::string("not calibrated: ") + error.what();
  }
}

int run_proxy_command(const ProxyCommand &command) {
  Mesh file = read_mesh(command.mesh_path);
  for (double &x : file.positions) x *= command.scale;
  Scene scene;
  std::vector<std::string> inputs;
  for (const std::string &pin : command.pins) scene.supports.push_back(read_pin(pin, inputs));
  const Mesh proxy = make_proxy(file, command.options, command.weld, all_of(find_supports(scene, file)));
  std::printf("%s: %s\n", command.mesh_path.c_str(), describe_proxy(proxy.proxy->info).c_str());
  std::printf("triangles: quality %.2f on average, %.2f at worst (1 is equilateral)\n", proxy.proxy->info.mean_quality, proxy.proxy->info.worst_quality);
  if (!command.out.empty()) {
    const std::filesystem::path out(command.out);
    const std::string parent = out.parent_path().empty() ? "." : out.parent_path().string();
    OutputFolder folder(parent, {command.mesh_path});
    write_obj(folder, out.filename().string(), proxy.positions, proxy);
    folder.put_in_place();
    std::printf("wrote %s: simulate %s --render %s\n", command.out.c_str(), command.out.c_str(), command.mesh_path.c_str());
  }
  if (!command.frequencies) return 0;
  tell_frequencies(command.mesh_path, file, proxy, scene.supports);
  return 0;
}

}  // namespace cli
