// All that a host's node tells the glue at one evaluation. Lengths in the scene's unit, seconds, angles where named.
#pragma once

#include "method.hpp"
#include "polygon.hpp"
#include "pose.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace shellwarp {
class Proxy;
}

namespace host {

// Points and faces in the object's own space. Indices are from 0.
struct Mesh {
  std::vector<double> points;       // n x 3
  std::vector<uint32_t> triangles;  // n x 3
  // Polygons in the triangles' place: how many corners each has, 3 or more, and the corners, one polygon after the other. Whoever makes a
  // model or a solid cuts them then: cut anew as points move, they would be another mesh each time.
  std::vector<uint32_t> sizes{}, corners{};

  uint32_t n_points() const { return static_cast<uint32_t>(points.size() / 3); }
  uint32_t n_triangles() const { return static_cast<uint32_t>(triangles.size() / 3); }
  const std::vector<uint32_t> &faces() const { return sizes.empty() ? triangles : corners; }
  void cut() {
    if (!sizes.empty()) triangles = cut_polygons(sizes, corners, points.data());
  }
};

// How stiff the shell is, in one of five ways; their numbers are hosts' menus.
struct Stiffness {
  enum class By { frequency = 0, material = 1, preset = 2, sheet = 3, sag = 4 };
  By by = By::frequency;
  bool by_look() const { return by == By::frequency || by == By::sag; }  // of a sheet whose clock is set
  bool by_sheet() const { return by == By::preset || by == By::sheet; }  // in engineering units

  double frequency = 2;  // Hz of the slowest mode that swings, > 0 (by frequency)
  // By sag: how far the vertex that moves furthest hangs at rest, > 0, in the object's length; and gravity in its axes and length. An evaluation fills
  // gravity in, as it is at the start frame or where the shell is first seen.
  double sag = 0;
  Vec3 sag_gravity{};
  // In the object's space. By frequency and sag 0 is a two-hundredth of the mesh's size, by preset 0 is the preset's own.
  double thickness = 0;

  // SwMaterialDesc, by material.
  double bend = 1, stretch = 1e4, density = 1;

  // By preset: its index in the library's table. By sheet: Pa, and kg/m3.
  uint32_t preset = 0;
  double young = 3e9, poisson = 0.3, volume_density = 1000;
  double metres = 1;  // in a unit of the object's space, for both

  // Factors at the points of what is drawn, above 0; empty is 1 everywhere. By preset and sheet of the thickness and Young's modulus, by material of
  // `bend` and `stretch`, and of the mass always. Those of another kind do nothing.
  std::vector<double> thickness_map, young_map, density_map, bend_map, stretch_map;
  std::vector<double> growth_map;  // the same on lengths without stress, whatever the stiffness is from

  // By preset and sheet: above 0, Young's modulus across a direction in Pa, and `young` is that along; and the shear modulus, 0 = Huber's estimate.
  double young_across = 0, shear = 0;
  std::vector<double> directions;  // one, or one for each polygon of what is drawn (n x 3)
  std::vector<double> middles;     // of these polygons (n x 3), where another mesh is simulated
};

// A vertex that is held along axes of the object alone.
struct AxisSupport {
  uint32_t vertex = 0;
  uint32_t axes = 0;       // SW_AXIS_... or'ed
  uint32_t symmetric = 0;  // those besides that are normals of planes of symmetry
};

// A vertex that is held together with another, or with a polygon where `to_face`.
struct Tie {
  uint32_t vertex = 0, to = 0;
  bool to_face = false;
  double stiffness = 0;  // force per length: N/m of a sheet, in units of E h by frequency; 0 = stiff
};

// An edge that bends by another stiffness, rests at another angle, or yields.
struct Crease {
  uint32_t a = 0, b = 0;
  double factor = 1;             // on the stiffness against bending, 0 or more
  std::optional<double> angle{};  // rad, above 0 convex on the side of the normals of corners that run counterclockwise; none: as the mesh has it
  double yield = 0;               // rad: how far it comes from its rest angle elastically; 0 = as far as it goes
};

// What the model is made of; a change of any of it is a new precompute, but of the method only where the two need different models.
struct Build {
  uint32_t method = kDefaultMethod;   // SW_METHOD_..., any of the library's table
  uint32_t reduced_fields = kFields;  // of methods that need fields, and of a choice
  // Of a choice: the largest error that will do, in the object's space. 0 = no trials: SW_PRECOMPUTE_AUTO.
  double auto_error = 0;
  std::vector<uint32_t> held;  // vertices that do not move in the object's space
  bool clamped = true;         // with their slope, or hinged
  uint32_t modes = 16;         // 1 to 1024
  bool double_precision = false;
  std::vector<uint32_t> contact_patches;  // vertices that are touched by what is smaller than the modes: each adds a mode
  double patches_near = 0;     // length of the scene: such vertices are also looked for so near to colliders at the start frame; 0: none
  uint32_t most_patches = 16;  // that are looked for, 1 to 128
  uint32_t support_fields = 24;  // of methods that follow by them, where supports move against each other; 0: none
  std::vector<AxisSupport> axis_supports;  // those that are held besides are held
  std::vector<Tie> ties;
  double tie_within = 0;  // pieces this near are tied; 0: none
  // Of the mesh that is simulated, with no other in its place. So are ties to polygons.
  std::vector<Crease> creases;
  std::vector<double> rest_shape;  // the points without stress (n x 3), where the mesh is not that
  Stiffness stiffness;  // its frequency or sag alone needs no precompute
  std::shared_ptr<const shellwarp::Proxy> proxy;  // the runner's own: that whose mesh is simulated, by which models are calibrated
};

// How the shell moves; a change starts again from the start frame.
struct Motion {
  bool implicit_euler = false;  // in place of the exact integrator, or the full shell's of second order; damps with the step
  double damping_ratio = 0.05;  // of critical, 0 or more
  double damping_mass = 0;      // 1/s, 0 or more: slows whatever moves, swinging or not
  double damping_stiffness = 0;  // s, 0 or more: slows fast swings most
  std::vector<double> damping_map;  // factors at the points of what is drawn on ratio and mass, 0 or more; empty is 1 everywhere
  double start_time = 0;        // s
  double frame_rate = 24;       // frames per second, > 0
};

struct Handle {
  uint32_t vertex = 0;
  Pose target;  // world
  bool position = true, orientation = false;
  double compliance = 0;  // length/force and rad/torque, 0 = hard
  uint32_t axes = SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z;  // of the world, along which the position is held
  bool held = true;                                    // false: let go
};

// A solid that the shell touches. Its mesh is in axes of its own and has its scale. Points that move as one count as a pose; others
// are a new shape, but of SW_COLLIDER_DEFORMING_MESH.
struct Collider {
  std::string name;                  // for messages
  uint32_t kind = SW_COLLIDER_MESH;  // SW_COLLIDER_...; all but the mesh itself are fitted round it
  Mesh mesh;                         // in lengths of the scene
  Pose pose;                         // world; its scale is not used
  double friction = 0.3;             // Coulomb's coefficient, 0 or more
  double thickness = 0;              // length of the scene, 0 or more: how far the shell stays off
  uint32_t cells = 64;               // of a mesh: cells along its longest side, 4 to 2000
  bool one_sided = false;            // of a mesh or a deforming one: it may be open, and is solid behind its polygons by the depth
  double depth = 0;                  // length of the scene; 0 = the library's default
};

// Air that drags at the shell: SwWindDesc.
struct Wind {
  Vec3 velocity{};  // world, length/s
  // kg/m3, 0 = no air. A shell by frequency or sag is taken for a sheet of 0.2 kg/m2; of a material it is in the material's mass, per length
  // in the object's space cubed.
  double density = 0;
  double normal_drag = 1.5, tangential_drag = 0.05;
  std::vector<double> local{};  // beside the velocity everywhere, at the points of what is drawn (n x 3), world; empty: none
};

// What may be animated; read at every evaluation.
struct Inputs {
  Vec3 gravity{};  // world, length/s²
  double stiffness_factor = 1;  // on all stiffness, 1e-9 to 1e9; rounded to a float
  Wind wind;
  // At the points (n x 3), world axes; empty: none. Newtons, where a shell by frequency or sag is taken for a sheet of 0.2 kg/m2; of a material in
  // its mass, the object's length and seconds.
  std::vector<double> forces;
  Pose object;     // where the object stands in the world
  Pose frame;      // what shakes the shell; the object's own pose unless the host is told otherwise
  std::vector<Handle> handles;
  std::vector<Collider> colliders;
  std::vector<double> supports;  // object's axes; the runner's own, from Request::follow
  std::vector<double> rest;      // the same of all points, from Request::follow_rest
};

// A mesh made of the host's and simulated in its place: SwProxyDesc.
struct ProxyWanted {
  uint32_t vertices = 0;  // 0: none
  double thickness = 0, weld = 0;
  bool cut = false;
};

struct Request {
  double time = 0;  // s
  Mesh mesh;        // as it comes in now
  // Points of any mesh that follow (n x 3), where they are now, in the same axes; empty: the mesh itself is drawn. Where there are such
  // points, vertices of supports and handles are theirs.
  std::vector<double> drawn;
  ProxyWanted proxy;  // where nothing is drawn but the mesh itself, which is drawn then
  bool velocities = false;  // of what is drawn, for motion blur
  Build build;
  Motion motion;
  Inputs inputs;
  // Held vertices are where the mesh has them now: the shell follows, and what it gives takes the place of all points that come in. Else
  // they stand in the frame, and what moves points is carried along.
  bool follow = false;
  bool follow_rest = false;  // with that: all points that come in are the shell's rest shape, as it moves
  uint32_t correction_steps = 0;  // Newton steps of the full shell to what is shown, 0 to 100; not at the start frame, nor by drawn or proxy
  bool push_out = false;  // what is shown is pushed out of solids, and the motion does not know; not with correction steps, drawn or proxy
  bool certify = false;  // estimate this frame's error, which takes seconds on large meshes
  // True: give up. Asked while a model is built and while frames are caught up with, never for a single step. May be empty.
  std::function<bool()> interrupted;
  // Hears how far a phase of the precompute is, SW_PHASE_... and 0 to 1, before `interrupted` is asked. May be empty.
  std::function<void(uint32_t, double)> progress;
};

}  // namespace host
