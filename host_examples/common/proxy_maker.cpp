#include "proxy_maker.hpp"

#include "hash.hpp"
#include "shell_model.hpp"
#include "shellwarp.hpp"
#include "support_places.hpp"

#include <algorithm>
#include <utility>

namespace host {

namespace {

// What is held, in any order.
std::vector<uint32_t> held_of(const Build &build, uint32_t n_points) {
  std::vector<uint32_t> held = build.held;
  for (const AxisSupport &support : build.axis_supports) held.push_back(support.vertex);
  held.erase(std::remove_if(held.begin(), held.end(), [&](uint32_t v) { return v >= n_points; }), held.end());  // whoever builds says so
  return held;
}

uint64_t key_of(const Mesh &mesh, const ProxyWanted &wanted, const std::vector<uint32_t> &held) {
  return Hash()
      .add(mesh.n_points())
      .add_all(mesh.faces())
      .add_all(mesh.sizes)
      .add(wanted.vertices)
      .add(wanted.thickness)
      .add(wanted.weld)
      .add(wanted.cut)
      .add_all(held)
      .value();
}

uint32_t ask(void *user, uint32_t, double) noexcept {
  try {
    return (*static_cast<const std::function<bool()> *>(user))() ? SW_PROGRESS_CANCEL : SW_PROGRESS_CONTINUE;
  } catch (...) {
    return SW_PROGRESS_CANCEL;
  }
}

}  // namespace

void ProxyMaker::make(const Request &request, const std::vector<uint32_t> &triangles) {
  const Mesh &mesh = request.mesh;
  SwProxyDesc desc = shellwarp::proxy_desc();
  desc.n_vertices = request.proxy.vertices;
  desc.weld = request.proxy.weld;
  desc.thickness = request.proxy.thickness;
  desc.flags = request.proxy.cut ? SW_PROXY_CUT : 0;
  const std::vector<uint32_t> held = held_of(request.build, mesh.n_points());
  desc.held = held.data(), desc.n_held = static_cast<uint32_t>(held.size());
  if (request.interrupted) {
    desc.progress = ask;
    desc.progress_user = const_cast<std::function<bool()> *>(&request.interrupted);
  }
  try {
    proxy_ = std::make_shared<const shellwarp::Proxy>(
        shellwarp::mesh_desc(mesh.points.data(), mesh.n_points(), triangles.data(), static_cast<uint32_t>(triangles.size() / 3)), desc);
    const shellwarp::Proxy &proxy = *proxy_;
    points_ = proxy.positions();
    triangles_ = proxy.triangles();
    proxy.sources(sources_, weights_);
  } catch (const shellwarp::Error &error) {
    if (error.status() == SW_ERROR_CANCELLED) throw Interrupted();
    throw;
  }
  rest_ = mesh.points;
}

void ProxyMaker::take_place(Request &request, bool anew) {
  if (!request.proxy.vertices || !request.drawn.empty()) return;
  Mesh &mesh = request.mesh;
  if (mesh.points.empty() || mesh.faces().empty()) return;  // whoever builds says so
  const bool with_slope = request.build.clamped && !request.build.stiffness.by_sheet();
  const uint64_t key = Hash().add(key_of(mesh, request.proxy, held_of(request.build, mesh.n_points()))).add(with_slope).value();
  if (key != key_ || (anew && mesh.points != rest_)) {
    Mesh cut = mesh;
    cut.cut();
    key_ = 0;
    held_ = with_slope ? with_neighbours(cut.triangles, request.build.held) : request.build.held;
    request.build.held = held_;
    make(request, cut.triangles);
    key_ = key;
  }
  request.build.held = held_;
  Mesh proxy;
  proxy.points = points_;
  proxy.triangles = triangles_;
  if (mesh.points != rest_)
    for (std::size_t v = 0; v < points_.size() / 3; ++v)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t from = 3 * std::size_t{sources_[3 * v + k]};
        for (std::size_t c = 0; c < 3; ++c) proxy.points[3 * v + c] += weights_[3 * v + k] * (mesh.points[from + c] - rest_[from + c]);
      }
  request.build.proxy = proxy_;
  request.drawn = std::move(mesh.points);
  mesh = std::move(proxy);
}

}  // namespace host
