// The mesh that is drawn where another is simulated: its points follow the simulated shell. For a scene called NAME:
//
//   NAME_render.pc2              its points over time
//   NAME_render_rest.obj         as it was given, scaled
//   NAME_render_frame_0042.obj   at the frames of which the simulated shell is written; faces, texture coordinates and groups are the file's own
#pragma once

#include "mesh.hpp"
#include "output_file.hpp"
#include "point_cache.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"
#include "simulation.hpp"

#include <optional>
#include <string>
#include <vector>

namespace cli {

class RenderMesh {
public:
  // Reads the scene's render mesh.
  explicit RenderMesh(const Scene &scene);

  uint32_t n_points() const { return mesh_.n_vertices(); }
  // To the model's mesh, once. Throws std::runtime_error that names the file.
  SwBindingInfo bind(const shellwarp::Model &model);
  // Where its points are, after the scene's correction steps.
  std::vector<float> points(const Scene &scene, const shellwarp::State &state) const;
  // Writes all frames of a run. `state` is left at one of them.
  void write(OutputFolder &folder, const Scene &scene, const std::vector<std::size_t> &chosen, const Run &run,
             shellwarp::State &state) const;

private:
  void write_obj(OutputFolder &folder, const std::string &name, const std::vector<float> &positions) const;

  std::string path_, contents_;  // of an OBJ file
  Mesh mesh_;
  std::optional<shellwarp::Binding> binding_;
};

}  // namespace cli
