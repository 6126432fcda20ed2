// Further methods beside the one that ran: each runs the scene anew, and goes onto the page with how far apart they are.
#pragma once

#include "film.hpp"
#include "handle_motion.hpp"
#include "mesh.hpp"
#include "page.hpp"
#include "run.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"
#include "simulation.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace cli {

// The shell with what was said of it, and the methods that it is to be compared with.
void add_to_page(const Scene &scene, const Mesh &mesh, const std::vector<PlacedHandle> &handles, uint32_t n_frames,
                 const Run &run, const Film &film, const std::vector<std::string> &words,
                 const shellwarp::Model &model, const RunOptions &options, Page &page);

}  // namespace cli
