// A mesh to simulate in a file's place: see sw_proxy_create.
#pragma once

#include "mesh.hpp"
#include "shellwarp.hpp"

#include <optional>
#include <string>
#include <vector>

namespace cli {

struct ProxyOptions {
  uint32_t vertices = 0;             // 0: no proxy
  std::optional<double> thickness;  // sides no further apart become one; 0 keeps both; else they are found
  bool cut = false;                  // where the file is no manifold
  bool calibrated = true;            // its stiffness is fitted to the file's
};

// The proxy of a file's mesh, scaled. Vertices within `weld` of each other are one. `mesh.of_file` tells the nearest vertex of the proxy, groups come along,
// and `mesh.proxy` tells the rest. The outline of the vertices `held` is kept. Throws std::runtime_error with the place and what to do.
Mesh make_proxy(const Mesh &file, const ProxyOptions &options, std::optional<double> weld, const std::vector<uint32_t> &held, const std::vector<uint32_t> &clamped = {});

// "2009 vertices and 3990 triangles stand for 13117 vertices; ..."
std::string describe_proxy(const SwProxyInfo &info);

// Fits the stiffness of a model of `mesh`, which is a proxy, to that of the file; what came of it, or why nothing did, in words, which name other materials unless it is a
// sheet.
std::string calibrate(shellwarp::Model &model, const Mesh &mesh, bool is_sheet);

// `shellwarp proxy`: makes a proxy, writes it unless `out` is empty, and tells how near it comes to the file's mesh: vertices, and ten frequencies where that is a shell.
struct ProxyCommand {
  std::string mesh_path, out;
  double scale = 1;
  std::optional<double> weld;
  ProxyOptions options;
  std::vector<std::string> pins;
  bool frequencies = true;
};
int run_proxy_command(const ProxyCommand &command);

}  // namespace cli
