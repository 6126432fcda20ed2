#include "runner_keys.hpp"

#include "collider_set.hpp"
#include "hash.hpp"

namespace host {

uint64_t key_of(const Request &request) {
  const Motion &m = request.motion;
  const Build &build = request.build;
  const Stiffness &stiffness = build.stiffness;
  return Hash()
      .add(build.method)
      .add(m.implicit_euler)
      .add(m.damping_ratio)
      .add(m.damping_mass)
      .add(m.damping_stiffness)
      .add_all(m.damping_map)
      .add(m.start_time)
      .add(m.frame_rate)
      .add(stiffness.by)
      .add(stiffness.frequency)
      .add(stiffness.by == Stiffness::By::sag ? stiffness.sag : 0)
      .add_all(stiffness.by == Stiffness::By::sag ? stiffness.sag_gravity : Vec3{})
      .add(request.inputs.colliders.size())
      .add(request.follow && request.follow_rest)
      .value();
}

static void add(Hash &hash, const Pose &pose) { hash.add_all(pose.origin).add_all(pose.rotation).add(pose.scale); }

uint64_t key_of(const Inputs &inputs) {
  Hash hash;
  hash.add_all(inputs.rest).add_all(inputs.forces).add_all(inputs.gravity).add(inputs.stiffness_factor).add_all(inputs.supports);
  const Wind &wind = inputs.wind;
  hash.add_all(wind.velocity).add(wind.density).add(wind.normal_drag).add(wind.tangential_drag).add_all(wind.local);
  add(hash, inputs.object);
  add(hash, inputs.frame);
  for (const Handle &handle : inputs.handles) {
    add(hash, handle.target);
    hash.add(handle.vertex).add(handle.position).add(handle.orientation).add(handle.compliance).add(handle.axes).add(handle.held);
  }
  for (const Collider &collider : inputs.colliders) {
    add(hash, collider.pose);
    hash.add(shape_key(collider));
  }
  return hash.value();
}

}  // namespace host
