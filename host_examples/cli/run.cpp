#include "run.hpp"

#include "advice.hpp"
#include "choice.hpp"
#include "comparison.hpp"
#include "frame_files.hpp"
#include "judge.hpp"
#include "mesh.hpp"
#include "moving_files.hpp"
#include "method.hpp"
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
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

namespace cli {

namespace {

int tell_violations(const std::vector<std::string> &sentences) {
  for (const std::string &sentence : sentences)
    std::fprintf(stderr, "shellwarp: not as expected: %s\n", sentence.c_str());
  return sentences.empty() ? 0 : kFailure;
}

void say(const std::string &sentence, bool quiet) {
  if (quiet || sentence.empty()) return;
  std::printf("%s\n", sentence.c_str());
  std::fflush(stdout);
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

shellwarp::Model precompute(const Scene &scene, const Mesh &mesh, bool quiet) {
  ProgressBar progress(quiet);
  return make_model(scene, mesh, progress);
}

int run_comparison(const Scene &scene, const Mesh &mesh, const RunOptions &options, OutputFolder *folder) {
  const ComparisonRun run = compare(scene, mesh, options.quiet);
  if (!options.quiet) print_comparison(scene, run);
  if (folder) write_comparison(*folder, scene, mesh, run);
  if (interrupted()) return tell_stopped(scene, "before the last equilibrium");
  if (folder) folder->put_in_place();
  return tell_violations(violations(scene, run));
}

constexpr uint32_t kMostJudged = 5000;  // vertices of which the error of a frame takes a fraction of a second

// Whether errors are estimated: not of the full shell, nor where nobody would read them. The automatic choice goes by them.
bool is_judged(const Scene &scene, const RunOptions &options, uint32_t n_vertices) {
  const bool read = !options.quiet || !options.html.empty() || options.view || (host::needs_choice(scene.method) && n_vertices <= kMostJudged);
  return read && !options.no_certify && !host::is_full_shell(scene.method);
}

// Of so many frames beside the most displaced, the last one among them. Of large meshes each takes seconds.
std::size_t n_judged(const Scene &scene, const RunOptions &options, uint32_t n_vertices) {
  return !is_judged(scene, options, n_vertices) ? 0 : n_vertices > kMostJudged ? 1 : 8;
}

// Whether a twin by steps twice as long is to tell what the steps cost; of a quiet run, too, whose steps go by it.
bool has_twin(const Scene &scene, const RunOptions &options) {
  return (!options.quiet || !options.html.empty() || options.view || scene.steps_open) && !options.no_certify;
}

uint32_t method_of(const Scene &scene, const SwModelInfo &info) { return host::needs_choice(scene.method) ? info.auto_method : scene.method; }

ErrorEstimate estimate_at(const FrameRecord &frame, const SwCertificate &found) {
  return {frame.report.time, found.error, frame.report.max_displacement};
}

// The estimate at a few frames before the last one, the most displaced among them.
void estimate_errors(bool quiet, Run &run) {
  if (!run.certificate) return;
  Watch watch("estimating the errors over time", quiet, static_cast<uint32_t>(run.judged.size()));
  for (const KeptFrame &kept : run.judged) {
    if (interrupted()) break;
    watch.at(static_cast<uint32_t>(&kept - run.judged.data()));
    try {
      run.estimates.push_back(estimate_at(run.frames[kept.frame], kept.state->certify()));
    } catch (const shellwarp::Error &) {  // there is none of this shape
    }
  }
  run.judged.clear();
  run.estimates.push_back(estimate_at(run.frames.back(), *run.certificate));
}

// The errors of the last frame and of some before, estimated. The run is whole without: where there is no estimate, the table says why.
void certify(const Scene &scene, const RunOptions &options, shellwarp::State &state, uint32_t n_vertices, Run &run) {
  constexpr uint32_t kMost = 50000;  // some tens of seconds
  if (!is_judged(scene, options, n_vertices) || run.interrupted) return;
  if (!options.certify && n_vertices > kMost) {
    run.uncertified = format("of %u vertices it would take long; --certify estimates it", n_vertices);
    return;
  }
  {
    const Watch watch("estimating the error", options.quiet);
    try {
      run.certificate = state.certify();
    } catch (const shellwarp::Error &error) {
      run.uncertified = error.what();
    }
  }
  estimate_errors(options.quiet, run);
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

// What menus call its method; of the automatic choice, what that took.
std::string label_of(const Scene &scene, const SwModelInfo &info) {
  const std::string label = sw_method_label(scene.method);
  return host::needs_choice(scene.method) ? label + ": " + sw_method_label(info.auto_method) : label;
}

// What a run keeps that is read later, of the model's method.
Keep keep_of(const Scene &scene, const RunOptions &options, const Mesh &mesh, const shellwarp::Model &model, bool states) {
  return {states, n_judged(scene, options, mesh.n_vertices()), has_twin(scene, options), method_of(scene, model.info())};
}

// The same scene by another method, onto the page. A model that was made for another one does, where it offers the method and was not chosen
// by a budget, which may have taken other modes.
std::optional<Film> add_method(const Scene &scene, const Mesh &mesh, const std::vector<PlacedHandle> &handles, uint32_t n_frames,
                const shellwarp::Model &made, const RunOptions &options, Page &page) {
  std::optional<shellwarp::Model> own;
  if (!made.front().empty() || sw_model_offers(made.get(), scene.method) != SW_OK) own.emplace(precompute(scene, mesh, options.quiet));
  const shellwarp::Model &model = own ? *own : made;
  shellwarp::State state = make_state(scene, mesh, model);
  Film film(mesh, n_frames, options.compare.size() + 1);
  Run run;
  try {
    run = simulate(scene, n_frames, mesh, handles, state, nullptr, &film, options.quiet, keep_of(scene, options, mesh, model, false));
  } catch (const std::runtime_error &error) {  // the others go on, and the page says why this one is not there
    const std::string sentence = std::string("note: ") + sw_method_label(scene.method) + " is left out: " + error.what();
    std::fprintf(stderr, "%s\n", sentence.c_str());
    page.add_words({sentence});
    return std::nullopt;
  }
  if (run.interrupted) return std::nullopt;
  certify(scene, options, state, mesh.n_vertices(), run);
  std::vector<std::string> words = closing_words({scene, model.info(), model.frequencies(), run, {}, {}, {}, mesh.proxy.get(), true});
  for (std::string &sentence : words) {
    sentence = std::string(sw_method_label(scene.method)) + ": " + sentence;
    if (!options.quiet) std::printf("%s\n", sentence.c_str());
  }
  page.add_film(scene, run, film, words, label_of(scene, model.info()));
  return film;
}

constexpr double kTold = 60;  // s, from which on it is said how long it may take

struct Compared {
  std::string name;
  bool full;
  const Film *film;
};

// How far apart the methods are: of the full shell where one of them is, else of the first. Of what adds up over time, too, which no estimate of a moment has.
void tell_differences(const std::vector<Compared> &all, bool quiet, Page &page) {
  const auto full = std::find_if(all.begin(), all.end(), [](const Compared &c) { return c.full; });
  const Compared &reference = full == all.end() ? all.front() : *full;
  for (const Compared &c : all) {
    if (&c == &reference) continue;
    const Film::Difference off = c.film->from(*reference.film);
    const std::string sentence = "difference: " + c.name + " is " + format("%.2g %% of the largest displacement off %s at most, at %.3g s; %.2g %% at the end", 100 * off.worst,
                                                                        reference.name.c_str(), off.seconds, 100 * off.at_end);
    say(sentence, quiet);
    page.add_words({sentence});
  }
}

// The shell with what was said of it, and the methods that it is to be compared with.
void add_to_page(const Scene &scene, const Mesh &mesh, const std::vector<PlacedHandle> &handles, uint32_t n_frames,
                 const Run &run, const Film &film, const std::vector<std::string> &words,
                 const shellwarp::Model &model, const RunOptions &options, Page &page) {
  const SwModelInfo info = model.info();
  page.add_shell(scene, mesh, handles, film);
  page.add_film(scene, run, film, words, label_of(scene, info));
  std::set<uint32_t> shown;
  std::deque<Film> films;
  const uint32_t taken = method_of(scene, info);
  std::vector<Compared> all = {{host::method_name(taken), host::is_full_shell(taken), &film}};
  for (const std::string &name : options.compare) {
    Scene other = scene;
    other.method = *host::find_method(name);
    if (!scene.integrator && host::is_full_shell(other.method)) other.integrator = SW_INTEGRATOR_SECOND_ORDER;  // others are measured by it
    const bool chosen = host::needs_choice(scene.method);
    const bool is_there = other.method == scene.method || (chosen && other.method == info.auto_method);
    const bool twice = !shown.insert(other.method).second;
    if ((is_there || twice) && !options.quiet)
      std::printf("%s is on the page already: %s\n", name.c_str(), twice ? "--compare names it twice" : other.method != scene.method ? "auto took it" : "it is the method");
    if (is_there || twice || interrupted()) continue;
    const double seconds = host::is_full_shell(other.method) ? seconds_of_full_shell(mesh.n_vertices(), static_cast<double>(run.steps)) : 0;
    say("compared with " + name + (seconds > kTold ? ", up to " + duration_words(seconds) : "") + ":", options.quiet);
    std::optional<Film> made = add_method(other, mesh, handles, n_frames, model, options, page);
    if (!made) continue;
    films.push_back(std::move(*made));
    all.push_back({name, host::is_full_shell(other.method), &films.back()});
  }
  tell_differences(all, options.quiet, page);
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

// A run from the start to its end or where it was stopped, and how far off it is.
struct Attempt {
  shellwarp::State state;
  Film film;
  Run run;
};

constexpr double kSeen = 1e-3;  // of its size

// How far what moves of the shell is inside a collider before the first step.
double depth_inside(const Scene &scene, const Mesh &mesh, const shellwarp::State &state) {
  if (scene.colliders.empty()) return 0;
  std::vector<double> at(mesh.positions.size()), outside(at.size());
  state.positions(at.data(), mesh.n_vertices());
  state.positions_outside(outside.data(), mesh.n_vertices());
  double deepest = 0;
  for (std::size_t k = 0; k < at.size(); k += 3)
    deepest = std::max(deepest, std::hypot(outside[k] - at[k], outside[k + 1] - at[k + 1], outside[k + 2] - at[k + 2]));
  return deepest;
}

Attempt attempt(const Scene &scene, const RunOptions &options, uint32_t n_frames, const Mesh &mesh, const std::vector<PlacedHandle> &handles, const shellwarp::Model &model,
                PointCache *cache, bool on_page, const Keep &keep, const RenderMesh *render) {
  Attempt made{make_state(scene, mesh, model), Film(mesh, on_page ? n_frames : 0, options.compare.size() + 1), {}};
  const double deep = depth_inside(scene, mesh, made.state);
  if (deep > kSeen * model.info().size)
    say(format("note: the shell begins inside a collider, %.3g deep: it is pushed out at once, which may throw it; move the collider or the mesh apart", deep), options.quiet);
  made.run = simulate(scene, n_frames, mesh, handles, made.state, cache, on_page ? &made.film : nullptr, options.quiet, keep, render);
  made.run.begins_inside = deep > kSeen * model.info().size;
  return made;
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

// As many steps a frame as the motion needs, where nobody said how many; of the tries the one whose steps cost least. Long steps calm a swing, and may be nearer to
// their twin than shorter ones that begin to follow it: so it goes on.
template <class Again>
void settle_by_steps(const Mesh &mesh, uint32_t n_frames, uint32_t method, Scene &scene, std::optional<Attempt> &made, const Again &again) {
  const auto error = [&] { return made->run.step_estimate && made->run.step_estimate->failed.empty() ? made->run.step_estimate->error : 1e300; };
  uint32_t best = scene.steps_per_frame;
  double least = error();
  for (std::string note; !(note = settle_steps(mesh, n_frames, method, made->run, scene)).empty();) {
    again(note);
    if (made->run.interrupted || error() < least) best = scene.steps_per_frame, least = error();
  }
  if (best == scene.steps_per_frame) return;
  const uint32_t tried = std::exchange(scene.steps_per_frame, best);
  const double of_tried = error();
  again(format("%u steps a frame are no nearer; back to %u", tried, best));
  made->run.steps_tried = tried;
  made->run.error_of_tried = of_tried;
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
  const shellwarp::Model model = precompute(scene, mesh, options.quiet);
  if (mesh.proxy && !mesh.proxy->calibrated.empty()) say(scene.mesh_path + ": proxy: " + mesh.proxy->calibrated, options.quiet);
  const std::vector<std::string> warned = warnings.taken();
  told.insert(told.begin(), warned.begin(), warned.end());
  if (const std::string note = settle_choice(model, mesh, n_frames, scene); !note.empty()) {
    told.push_back(afterwards(note));
    if (host::is_full_shell(scene.method)) say(note, options.quiet);
  }
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
  settle_by_steps(mesh, n_frames, method_of(scene, model.info()), scene, made, again);
  certify(scene, options, made->state, mesh.n_vertices(), made->run);
  const uint32_t settled = std::exchange(scene.steps_per_frame, given);
  if (const std::string note = settle_late(model, mesh, n_frames, made->run, scene); !note.empty()) {
    told.push_back(afterwards(note));
    again(note);
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
  say("picture: " + options.png + ": at rest, where it moved furthest, and at the end" + (picture.times_larger() > 1 ? format(", motion drawn %.0f times as large", picture.times_larger()) : "") +
          "; grey: at rest; dots: what is held" + (picture.has_wind() ? "; arrow: the wind" : ""),
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
