// What a renderer needs of a run, for a scene called NAME in a directory of its choice:
//
//   NAME_rest.obj                      the rest shape
//   NAME_frame_0042.obj                the shell in the world, at frames of largest displacement, at the scene's obj_times or every obj_every frames
//   NAME_frame_0042_displacement.txt   how far each vertex is from its rest place as seen in the support frame, one number a
//                                      line; the same as the difference of the two OBJ files where the supports do not move
//   NAME_frame_0042_handles.csv        the handles held then, a row each: vertex, kind, where it is to be (x, y, z; along an
//                                      axis that is not held, where the vertex is), and for an orientation the world axes of
//                                      the vertex's frame (xx, xy, xz is what x has become, and so on to zz)
//   NAME_frames.csv                    every frame: frame, time, max_displacement, max_rotation, kinetic_energy,
//                                      elastic_energy, obj, displacement, handles; the last three name the files, where
//                                      written
//
// Vertices have the order of the mesh file in all of them, and all OBJ files have the same triangles.
#pragma once

#include "handle_motion.hpp"
#include "mesh.hpp"
#include "output_file.hpp"
#include "scene.hpp"
#include "simulation.hpp"

#include <string>
#include <vector>

namespace cli {

// Whether a run, a comparison or a skeleton called `scene` may write a file of that name.
bool is_output(const std::string &scene, const std::string &name);

// Where a frame shows the vertices, of which `state` has been set to.
std::vector<float> shown_positions(const FrameRecord &frame, const Mesh &mesh, const shellwarp::State &state);

// NAME_frame_0042.
std::string frame_file_name(const std::string &name, uint32_t frame);

// Of which frames OBJ files are written.
std::vector<std::size_t> chosen_frames(const Scene &scene, const std::vector<FrameRecord> &frames);

// Indices into `frames`, ascending: the largest `count` of the local maxima of displacement over time.
std::vector<std::size_t> extreme_frames(const std::vector<FrameRecord> &frames, std::size_t count);

// Indices into `frames` of those whose number `every` divides, the start first.
std::vector<std::size_t> regular_frames(const std::vector<FrameRecord> &frames, uint32_t every);

// Indices into `frames` of those nearest to the given times, ascending; none for a time that the run has not reached.
std::vector<std::size_t> timed_frames(const std::vector<FrameRecord> &frames, const std::vector<double> &times);

// `state` is used to go back to the frames that are written, and is left at the last of them.
void write_frame_files(OutputFolder &folder, const Scene &scene, const Mesh &mesh,
                       const std::vector<PlacedHandle> &handles, const Run &run, shellwarp::State &state);

}  // namespace cli
