#include "run.hpp"

#include "advice.hpp"
#include "attempt.hpp"
#include "choice.hpp"
#include "comparison.hpp"
#include "estimates.hpp"
#include "frame_files.hpp"
#include "judge.hpp"
#include "mesh.hpp"
#include "moving_files.hpp"
#include "method.hpp"
#include "methods_on_page.hpp"
#include "output_file.hpp"
#include "page.hpp"
#include "picture.hpp"
#include "point_cache.hpp"
#include "progress.hpp"
#include "render_files.hpp"
#include "rim.hpp"
#include "shell.hpp"
#include "simulation.hpp"
#include "skeleton.hpp"
#include "summary.hpp"
#include "warnings.hpp"
#include "watch.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

namespace cli {

namespace {

int tell_violations(const std::vector<std::string> &sentences) {
  for (const std::string &sentence : sentences)
    std::fprintf(stderr, "shellwarp: not as expected: %s\n", sentence.c_str());
  return sentences.empty() ? 0 : kFailure;
}

int tell_stopped(const Scene &scene, const std::string &where, bool shown = false) {
  std::fprintf(stderr, "shellwarp: %s was stopped %s; %s\n", scene.name.c_str(), where.c_str(), shown ? "what is written ends there" : "its files are as they were");
  return kInterrupted;
}

int report(const Summary &summary, const RunOptions &options, bool shown) {
  if (!options.quiet) print_summary(summary);
  if (summary.run.interrupted)
    return tell_stopped(summary.scene, "after frame " + std::to_string(summary.run.frames.back().frame), shown);
  if (options.frames && (summary.scene.expect.max_displacement || summary.scene.expect.final_displacement))
    std::fprintf(stderr, "shellwarp: displacements are not judged, because --frames changes the length of the run\n");
  return tell_violations(violations(summary, !options.frames));
}

int run_comparison(const Scene &scene, const Mesh &mesh, const RunOptions &options, OutputFolder *folder) {
  const ComparisonRun run = compare(scene, mesh, options.quiet);
  if (!options.quiet) print_comparison(scene, run);
  if (folder) write_comparison(*folder, scene, mesh, run);
  if (interrupted()) return tell_stopped(scene, "before the last equilibrium");
  if (folder) folder->put_in_place();
  return tell_violations(violations(scene, run));
}

// A slip of the keyboard should not run for years, or fill the disk.
void refuse_surprises(const Scene &scene, uint32_t n_frames, const Mesh &mesh, const OutputFolder *folder) {
  constexpr uint32_t kMany = 100000;  // an hour at 24 frames a second
  if (n_frames > kMany) throw std::runtime_error(format("%u frames are many; add --yes if they are meant", n_frames));
  const double each = (writes(scene, "pc2") ? 12.0 : 0) + (writes(scene, "usd") ? 140.0 : 0) + (writes(scene, "gltf") ? 24.0 : 0);
  const double bytes = each * mesh.n_vertices() * (n_frames + 1.0);
  if (folder && bytes > static_cast<double>(folder->free_bytes()))
    throw std::runtime_error(format("%s will take %.4g MB, and %.4g MB are free; add --yes to try",
                                    folder->path(scene.name).c_str(), bytes / 1e6,
                                    static_cast<double>(folder->free_bytes()) / 1e6));
}

void bind_render_mesh(const Scene &scene, const shellwarp::Model &model, bool quiet, RenderMesh &render) {
  const SwBindingInfo info = render.bind(model);
  if (!quiet)
    std::printf("%s: %u vertices follow the shell, of which vertex %u is the furthest from it, %.3g\n",
                scene.render_path.c_str(), info.n_points, info.furthest_point, info.furthest_distance);
}

void say_what_stands_in(const Scene &scene, const Mesh &mesh, bool quiet) {
  if (mesh.proxy)
    say(scene.mesh_path + ": proxy: " + describe_proxy(mesh.proxy->info), quiet);
  else if (scene.weld)
    say(format("%s: %zu vertices of the file are welded to %u", scene.mesh_path.c_str(), mesh.of_file.size(), mesh.n_vertices()), quiet);
}

// What was said before the work, without how long that would take.
std::string afterwards(const std::string &note) { return note.substr(0, std::min(note.find("; the same again"), note.find("; here about"))); }

// The mesh that is simulated. What auto becomes of limp cloth is settled here, before the long work, with a sentence; a proxy that cannot be made is done without.
Mesh settled_mesh(Scene &scene, uint32_t n_frames, bool on_page, bool quiet, std::vector<std::string> &told) {
  Mesh mesh = scene_mesh(scene);
  if (!quiet && scene.length_unit == "m") print_doubt_of_unit(scene.mesh_path, mesh);
  find_supports(scene, mesh);  // a slip in what is held is told first
  const Scene as_given = scene;
  std::string note = settle_early(mesh, n_frames, on_page, scene);
  if (scene.proxy.vertices != as_given.proxy.vertices) try {
      mesh = scene_mesh(scene);
    } catch (const std::runtime_error &) {
      scene = as_given;
      note = settle_early(mesh, n_frames, false, scene);
    }
  say(note, quiet);
  if (!note.empty()) told.push_back(afterwards(note));
  for (const std::string &rim : notes_of_rims(scene, mesh)) say(rim, quiet);
  return mesh;
}

void write_all(OutputFolder &folder, const Scene &scene, const Mesh &mesh, const std::vector<PlacedHandle> &handles, const shellwarp::Model &model, const RenderMesh *render,
               PointCache *cache, Attempt &made) {
  if (cache) cache->close();
  write_frame_files(folder, scene, mesh, handles, made.run, made.state);
  write_shell_motion(folder, scene, mesh, model, made.run, made.state);
  if (render) {
    render->write(folder, scene, chosen_frames(scene, made.run.frames), made.run, made.state);
    go_to(made.run, made.run.frames.back(), scene, made.state);
  }
  folder.put_in_place();
}

int run_scene(Scene scene, const RunOptions &options, OutputFolder *folder, Page *page, Picture *picture) {
  const uint32_t n_frames = scene.is_static ? 1 : options.frames ? *options.frames : frame_count(scene);
  std::vector<std::string> told;
  const Mesh mesh = settled_mesh(scene, n_frames, (page || picture) && !folder, options.quiet, told);
  if (!scene.motion_path.empty())
    scene.points = std::make_shared<const MovingPoints>(scene.motion_path, mesh.vertices_of_file(), scene.scale);
  say_what_stands_in(scene, mesh, options.quiet);
  {
    ProgressBar progress(options.quiet);
    scene.material = find_material(scene, mesh, progress);
  }
  if (scene.comparison) return run_comparison(scene, mesh, options, folder);
  if (!options.yes) refuse_surprises(scene, n_frames, mesh, folder);
  const std::vector<PlacedHandle> handles = place_handles(scene.handles, mesh);
  for (const std::string &line : found_vertices(handles)) say(line, options.quiet);
  std::optional<RenderMesh> render;
  if (!scene.render_path.empty()) render.emplace(scene);
  std::optional<PointCache> cache;  // opened first: a folder that cannot be written is told before the long work
  if (folder && writes(scene, "pc2")) cache.emplace(*folder, scene.name + ".pc2", mesh.n_vertices());
  Warnings warnings;
  const shellwarp::Model model = make_model(scene, mesh, options.quiet);
  if (mesh.proxy && !mesh.proxy->calibrated.empty()) say(scene.mesh_path + ": proxy: " + mesh.proxy->calibrated, options.quiet);
  const std::vector<std::string> warned = warnings.taken();
  told.insert(told.begin(), warned.begin(), warned.end());
  if (const std::string note = settle_choice(model, mesh, n_frames, scene); !note.empty()) {
    told.push_back(afterwards(note));
    if (host::is_full_shell(scene.method)) say(note, options.quiet);
  }
  settle_corrections(model, scene);
  if (render) bind_render_mesh(scene, model, options.quiet, *render);
  const auto run_it = [&] {
    return attempt(scene, options, n_frames, mesh, handles, model, cache ? &*cache : nullptr, page || picture, keep_of(scene, options, mesh, model, folder != nullptr), render ? &*render : nullptr);
  };
  std::optional<Attempt> made(run_it());
  const auto again = [&](const std::string &note) {
    say(note, options.quiet);
    if (cache) cache->restart();
    made.emplace(run_it());
  };
  const uint32_t given = scene.steps_per_frame;
  const std::optional<StepEstimate> first = made->run.step_estimate;
  settle_by_steps(mesh, n_frames, host::method_taken(scene.method, model.info()), scene, made, again);
  certify(scene, options, made->state, mesh.n_vertices(), made->run);
  const uint32_t settled = std::exchange(scene.steps_per_frame, given);
  const uint32_t wanted = std::max(settled, made->run.steps_tried);
  if (const std::string note = settle_late(model, mesh, n_frames, wanted, made->run, scene); !note.empty()) {
    told.push_back(afterwards(note));
    again(note);
    settle_by_steps(mesh, n_frames, scene.method, scene, made, again);
    certify(scene, options, made->state, mesh.n_vertices(), made->run);
  } else if (settled > given) {
    scene.steps_per_frame = settled;
    told.push_back(format("took %u steps a frame, as one costs about %.0f %% of the motion; --step says how long a step is", settled, 100 * first->error));
  }
  const Run &run = made->run;
  if (options.plan) std::fputs(made->state.plan_text(scene.step()).c_str(), stdout);
  const bool shown = !run.interrupted || (stopped_by_user() && run.frames.size() > 1);
  if (folder && shown) write_all(*folder, scene, mesh, handles, model, render ? &*render : nullptr, cache ? &*cache : nullptr, *made);
  const Summary summary{scene, model.info(), model.frequencies(), run, model.front(), find_creases(scene.material, mesh), told, mesh.proxy.get()};
  const int status = report(summary, options, shown);
  if (picture && shown) picture->add(mesh, made->film, all_of(find_supports(scene, mesh)), scene.loads.wind ? scene.loads.wind->velocity : std::array<double, 3>{}, scene.up.value_or(up_axis(scene, mesh)));
  if (page && shown) add_to_page(scene, mesh, handles, n_frames, run, made->film, closing_words(summary), model, options, *page);
  return interrupted() ? kInterrupted : status;
}

std::vector<std::string> inputs_of(const SceneFile &file) {
  std::vector<std::string> inputs;
  for (const Scene &scene : file.shells) inputs.insert(inputs.end(), scene.inputs.begin(), scene.inputs.end());
  return inputs;
}

// A folder to write to that holds no input under a name that is going to be written; none where nothing is written.
std::unique_ptr<OutputFolder> open_folder(const SceneFile &file, const RunOptions &options) {
  if (options.out.empty()) return nullptr;
  auto folder = std::make_unique<OutputFolder>(options.out, inputs_of(file));
  folder->refuse_inputs([&](const std::string &name) {
    return is_output(file.name, name) || std::any_of(file.shells.begin(), file.shells.end(),
                                                     [&](const Scene &scene) { return is_output(scene.name, name); });
  });
  return folder;
}

// Where the page goes; empty where none is asked for.
std::string page_path(const SceneFile &file, const RunOptions &options) {
  if (!options.html.empty() || !options.view) return options.html;
  namespace fs = std::filesystem;
  const char *user = std::getenv("USER");  // each has a folder of his own among the temporary files
  const fs::path folder = options.out.empty() ? fs::temp_directory_path() / ("shellwarp-" + std::string(user ? user : "page"))
                                              : fs::path(options.out);
  if (!options.out.empty()) return (folder / (file.name + ".html")).string();
  fs::path path = folder / (file.name + ".html");  // an earlier page may still be open in the browser, or written by a run beside
  std::error_code ignored;
  for (int k = 2; fs::exists(path, ignored) && k < 1000; ++k) path = folder / (file.name + "-" + std::to_string(k) + ".html");
  return path.string();
}

// A page that nobody can fill, or that would lie in a file's place, is told before the long work.
std::optional<Page> begin_page(const SceneFile &file, const RunOptions &options, const std::string &path) {
  if (path.empty()) {
    if (!options.compare.empty()) throw std::runtime_error("--compare puts methods on a page: add --html FILE or --view");
    return std::nullopt;
  }
  for (const Scene &scene : file.shells)
    if (scene.comparison) throw std::runtime_error("a [comparison] has equilibria and no motion to play; leave out the page");
  if (std::filesystem::is_directory(path)) throw std::runtime_error("cannot write " + path + ": it is a folder");
  page_folder(path, inputs_of(file));
  return Page(file.title.empty() ? file.name : file.title);
}

void finish_page(const Page &page, const SceneFile &file, const RunOptions &options, const std::string &path) {
  write_page(page, path, inputs_of(file));
  if (!options.quiet) std::printf("page: %s\n", path.c_str());
  std::fflush(stdout);
  if (options.view && !open_in_browser(path))
    std::fprintf(stderr, "shellwarp: nothing here opens a browser; open %s in one\n", path.c_str());
}

void finish_picture(const Picture &picture, const SceneFile &file, const RunOptions &options) {
  if (picture.empty()) return;
  write_picture(picture, options.png, inputs_of(file));
  say("picture: " + options.png + format(": at rest, where it moved furthest (%.3g s), and at the end (%.3g s)", picture.moments()[0], picture.moments()[1]) + (picture.times_larger() > 1 ? format(", motion drawn %.0f times as large", picture.times_larger()) : "") +
          "; grey: at rest; dots: what is held; lines: the axes" + (picture.has_wind() ? "; arrow: the wind" : ""),
      options.quiet);
}

// Those of all shells, made once.
std::vector<Collider> shared_colliders(const SceneFile &file, bool quiet) {
  const Scene &scene = file.shells.front();
  std::vector<Collider> colliders = scene.colliders;
  const Watch watch("preparing colliders", quiet);
  prepare_colliders(colliders, scene.scale);
  return colliders;
}

}  // namespace

// Shells do not touch each other, so they may run one after the other. The worst exit status; an interruption ends all, and each shell's files
// are put in place as it is done.
int run_shells(const SceneFile &file, const RunOptions &options) {
  for (const Scene &scene : file.shells) check_formats(scene);
  const std::unique_ptr<OutputFolder> folder = open_folder(file, options);
  const std::string path = page_path(file, options);
  std::optional<Page> page = begin_page(file, options, path);
  if (!options.png.empty()) page_folder(options.png, inputs_of(file));  // told before the long work
  Picture picture;
  const std::vector<Collider> colliders = shared_colliders(file, options.quiet);
  int worst = 0;
  for (Scene scene : file.shells) {
    scene.colliders = colliders;
    const int status = run_scene(scene, options, folder.get(), page ? &*page : nullptr, options.png.empty() ? nullptr : &picture);
    if (status == kInterrupted) {
      if (stopped_by_user()) finish_picture(picture, file, options);
      if (page && !page->empty() && stopped_by_user()) finish_page(*page, file, options, path);
      return status;
    }
    worst = std::max(worst, status);
  }
  if (folder && !file.skeleton.empty()) {
    const Scene &scene = file.shells.front();
    write_bones(*folder, file.name + "_bones.csv", file.skeleton, options.frames ? *options.frames : frame_count(scene),
                scene.frame_rate);
    folder->put_in_place();
  }
  finish_picture(picture, file, options);
  if (page) finish_page(*page, file, options, path);
  return worst;
}

}  // namespace cli
