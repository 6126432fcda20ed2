// All that a host's node tells the glue at one evaluation. Lengths in the scene's unit, seconds, angles where named.
#pragma once

#include "method.hpp"
#include "pose.hpp"

#include <cstdint>
#include <functional>
#include <vector>

namespace host {

// Points and triangles in the object's own space.
struct Mesh {
  std::vector<double> points;       // n x 3
  std::vector<uint32_t> triangles;  // n x 3, indices from 0

  uint32_t n_points() const { return static_cast<uint32_t>(points.size() / 3); }
  uint32_t n_triangles() const { return static_cast<uint32_t>(triangles.size() / 3); }
};

// How stiff the shell is, in one of two ways.
struct Stiffness {
  enum class By { frequency, material };
  By by = By::frequency;

  double frequency = 2;  // Hz of the slowest mode that swings, > 0 (by frequency)
  double thickness = 0;  // > 0, or 0 for a two-hundredth of the mesh's size: how much rather it bends than stretches

  // SwMaterialDesc, by material.
  double bend = 1, stretch = 1e4, density = 1;
};

// What the model is made of; a change of any of it is a new precompute, but of the method only where the two need different models.
struct Build {
  uint32_t method = kDefaultMethod;   // SW_METHOD_..., any of the library's table
  uint32_t reduced_fields = kFields;  // of methods that need fields, and of a choice
  double auto_error = 0;  // of a choice: the largest error that will do, in the object's space; 0 = the most accurate
  std::vector<uint32_t> held;  // vertices that do not move in the object's space
  bool clamped = true;         // with their slope, or hinged
  uint32_t modes = 16;         // 1 to 1024
  bool double_precision = false;
  Stiffness stiffness;  // its frequency alone needs no precompute
};

// How the shell moves; a change starts again from the start frame.
struct Motion {
  bool implicit_euler = false;  // in place of the exact integrator; damps with the step
  double damping_ratio = 0.05;  // of critical, 0 or more
  double damping_mass = 0;      // 1/s, 0 or more: slows whatever moves, swinging or not
  double start_time = 0;        // s
  double frame_rate = 24;       // frames per second, > 0
};

struct Handle {
  uint32_t vertex = 0;
  Pose target;  // world
  bool position = true, orientation = false;
  double compliance = 0;  // length/force and rad/torque, 0 = hard
};

// What may be animated; read at every evaluation.
struct Inputs {
  Vec3 gravity{};  // world, length/s²
  Pose object;     // where the object stands in the world
  Pose frame;      // what shakes the shell; the object's own pose unless the host is told otherwise
  std::vector<Handle> handles;
};

struct Request {
  double time = 0;  // s
  Mesh mesh;        // as it comes in now
  Build build;
  Motion motion;
  Inputs inputs;
  bool certify = false;  // estimate this frame's error, which takes seconds on large meshes
  // True: give up. Asked while a model is built and while frames are caught up with, never for a single step. May be empty.
  std::function<bool()> interrupted;
};

}  // namespace host
