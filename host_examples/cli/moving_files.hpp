// A run's motion as USD and glTF. For a scene called NAME, of the formats that it asks for:
//
//   NAME.usda, NAME.glb                  the simulated shell
//   NAME_render.usda, NAME_render.glb    the mesh that is drawn
#pragma once

#include "moving_mesh.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"
#include "simulation.hpp"

#include <string>
#include <vector>

namespace cli {

// "pc2", "usd", "gltf".
const std::vector<std::string> &file_formats();
bool writes(const Scene &scene, const char *format);

// Throws std::runtime_error where a scene asks for what its files cannot have. To be asked before the long work.
void check_formats(const Scene &scene);

// Where each vertex is in the world, out of colliders or after correction steps where asked for, and how fast it moves.
std::vector<float> read_points(const shellwarp::State &state, const shellwarp::Binding &binding, uint32_t n_points,
                               std::vector<float> *velocities = nullptr, bool outside = false, uint32_t correction_steps = 0);

// Gathers frames for the formats beside PC2.
class MotionFiles {
public:
  // `to_asset`: this is the mesh that lies over the scene's prim.
  MotionFiles(const Scene &scene, const Mesh &mesh, bool to_asset);

  bool wanted() const;
  void append(const FrameRecord &frame, std::vector<float> positions, std::vector<float> velocities);
  void write(OutputFolder &folder, const std::string &name);

private:
  const Scene &scene_;
  bool to_asset_;
  MovingMesh moving_;
};

// The shell's own files; goes through the frames of a run. `state` is left at the last of them.
void write_shell_motion(OutputFolder &folder, const Scene &scene, const Mesh &mesh, const shellwarp::Model &model, const Run &run,
                        shellwarp::State &state);

}  // namespace cli
