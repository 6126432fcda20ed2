// What is drawn follows what is simulated: points of any mesh by a binding of the library, and vertices that a user named on them.
#pragma once

#include "request.hpp"
#include "shellwarp.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

namespace host {

class Follower {
public:
  // What is done to what is shown, and where to tell how deep a push out of colliders leaves a point, or NULL.
  struct Moved {
    uint32_t correction_steps;
    bool outside;
    double *deepest;
  };

  // Vertices of supports, ties, forces, contact patches and handles, which are of request.drawn, become the nearest ones of the mesh. Maps, wind and directions,
  // which are of it too, become those of the nearest point and polygon. `anew`: both are at rest now. Throws HostError naming a vertex that there is not.
  void lead(Request &request, bool anew);

  // Throws shellwarp::Error, after which the binding is what it was.
  void bind(const shellwarp::Model &model, const std::vector<double> &points);
  void release();

  bool bound() const { return binding_.has_value(); }
  uint64_t bytes() const;
  const std::vector<double> &rest() const { return rest_; }
  // Takes vertices of the mesh that are at `rest` in `points` along with what they are named by on what is drawn.
  void carry(const Request &request, const std::vector<double> &rest, std::vector<double> &points) const;
  // In SW_SPACE_...; `velocities` is NULL, or what is asked for in the library's seconds.
  std::vector<double> read(const shellwarp::State &state, uint32_t space, const Moved &moved, std::vector<double> *velocities) const;

private:
  uint32_t nearest(const Request &request, uint32_t drawn);
  void lead_ties(Request &request);
  void lead_forces(Request &request);
  void lead_maps(Request &request, bool anew);

  std::map<uint32_t, uint32_t> nearest_;  // from drawn vertices that were named
  std::vector<uint32_t> point_at_, polygon_at_;  // the nearest drawn one of each vertex and polygon of the mesh, once maps or directions need them
  std::optional<shellwarp::Binding> binding_;
  std::vector<double> rest_;
};

}  // namespace host
