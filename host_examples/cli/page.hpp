// One self-contained HTML page that plays runs: `player/` with the motion in it. It asks nothing of the network.
#pragma once

#include "film.hpp"
#include "handle_motion.hpp"
#include "mesh.hpp"
#include "output_file.hpp"
#include "scene.hpp"
#include "shell.hpp"
#include "simulation.hpp"

#include <string>
#include <vector>

namespace cli {

// The player, with "{{motion}}" where the data goes; made of player/ by CMake.
extern const char kPlayerPage[];

// The axis that points up where nobody says: against gravity, else across a flat mesh, else y.
uint32_t up_axis(const Scene &scene, const Mesh &mesh);

class Page {
public:
  explicit Page(std::string title) : title_(std::move(title)) {}

  // A shell of the scene, by its first method. Films of the same shell by other methods follow it.
  void add_shell(const Scene &scene, const Mesh &mesh, const std::vector<PlacedHandle> &handles, const Film &film);
  // A film of the last shell. `words` is what is said of the run.
  // Sentences beside the picture.
  void add_words(const std::vector<std::string> &words);
  void add_film(const Scene &scene, const Run &run, const Film &film, const std::vector<std::string> &words, const std::string &label);

  bool empty() const { return tracks_.empty(); }
  std::string html() const;

private:
  std::string facts() const;

  std::string title_, unit_, times_;
  std::string shells_, tracks_, handles_, colliders_, loads_, words_;  // items of JSON arrays
  std::size_t n_shells_ = 0, n_frames_ = 0;
  uint64_t n_vertices_ = 0;
  uint32_t up_ = 1;
  double seconds_ = 0, most_ = 0;
};

// Where the page goes, made if it is missing; throws where that cannot be.
OutputFolder page_folder(const std::string &path, const std::vector<std::string> &inputs);

// Puts the page in place under its name, whole or not at all; `inputs` are never replaced.
void write_page(const Page &page, const std::string &path, const std::vector<std::string> &inputs);

// Has the platform open the file. False where there is nothing that opens it.
bool open_in_browser(const std::string &path);

}  // namespace cli
