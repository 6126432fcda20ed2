#include "request_checks.hpp"

#include "message.hpp"

#include <cmath>
#include <string>

namespace host {

static void require(bool good, const std::string &what) {
  if (!good) throw HostError(what);
}

void check_motion(const Request &request) {
  const Motion &m = request.motion;
  require(m.damping_ratio >= 0 && m.damping_ratio <= 1e6,
          "the damping ratio is " + number(m.damping_ratio) + "; it must be 0 or above");
  require(m.damping_mass >= 0 && m.damping_mass <= 1e6,
          "the mass damping is " + number(m.damping_mass) + "; it must be 0 or above");
  require(m.damping_stiffness >= 0 && m.damping_stiffness <= 1e6,
          "the stiffness damping is " + number(m.damping_stiffness) + "; it must be 0 or above");
  const double factor = request.inputs.stiffness_factor;
  require(factor >= 1e-9 && factor <= 1e9, "the factor on the stiffness is " + number(factor) + "; it must be from 1e-9 to 1e9");
  require(m.frame_rate > 0 && m.frame_rate <= 1e6,
          "the frame rate is " + number(m.frame_rate) + "; it must be above 0");
  require(std::isfinite(request.time) && std::isfinite(m.start_time), "the time is not finite");
}

void check_output(const Request &request) {
  require(request.drawn.empty() || request.proxy.vertices == 0, "there is a proxy, and one of " + number(uint64_t(request.proxy.vertices)) +
                                                                    " vertices is to be made: take the one away, or set the other to 0");
  require(request.proxy.thickness == 0 || request.proxy.vertices > 0, "the proxy's thickness is " + number(request.proxy.thickness) +
                                                                          ", and no proxy is to be made: set it to 0, or say how many vertices");
  require(request.correction_steps <= 100,
          "the correction steps are " + number(uint64_t(request.correction_steps)) + ", expected at most 100");
  require(!request.push_out || request.correction_steps == 0, "correction steps and pushing out both move what is shown: take one of them");
}

void check_place(const Request &request) {
  if (request.drawn.empty()) return;
  const char *why = " of the mesh that is simulated, and another is in its place: take no proxy, or leave them";
  require(request.build.creases.empty(), std::string("creases are") + why);
  for (const Tie &tie : request.build.ties) require(!tie.to_face, std::string("ties to polygons are") + why);
  require(request.build.rest_shape.empty(), std::string("the points of a rest shape are") + why);
}

void check_wind(const Request &request) {
  const Wind &wind = request.inputs.wind;
  require(wind.local.empty() || wind.local.size() == request.mesh.points.size(),
          "there is wind at " + number(uint64_t(wind.local.size() / 3)) + " points, but " + number(uint64_t(request.mesh.n_points())) + " points");
  for (std::size_t i = 0; i < wind.local.size(); ++i)
    require(std::isfinite(wind.local[i]), "the wind at point " + number(uint64_t(i / 3)) + " is not finite");
  const auto check = [](const char *name, double x) {
    require(x >= 0 && std::isfinite(x), std::string(name) + " is " + number(x) + "; it must be 0 or above");
  };
  check("the air's density", wind.density);
  check("the drag across the shell", wind.normal_drag);
  check("the drag along the shell", wind.tangential_drag);
}

void check_forces(const Request &request) {
  const std::size_t pulled = request.inputs.forces.size();
  require(pulled == 0 || pulled == request.mesh.points.size(),
          "there are forces on " + number(uint64_t(pulled / 3)) + " points, but " + number(uint64_t(request.mesh.n_points())) + " points");
}

void check_handles(const Request &request) {
  const std::vector<Handle> &handles = request.inputs.handles;
  for (std::size_t i = 0; i < handles.size(); ++i) {
    const std::string name = "handle " + number(uint64_t(i));
    require(handles[i].vertex < request.mesh.n_points(), name + " holds vertex " + number(uint64_t(handles[i].vertex)) +
                                                             ", but there are " +
                                                             number(uint64_t(request.mesh.n_points())));
    require(handles[i].compliance >= 0 && std::isfinite(handles[i].compliance),
            name + " has compliance " + number(handles[i].compliance) + "; it must be 0 or above");
    require(!handles[i].position || !handles[i].held || handles[i].axes != 0, name + " holds its position along no axis");
  }
}

}  // namespace host
