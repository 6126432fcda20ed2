#include "methods_on_page.hpp"

#include "advice.hpp"
#include "choice.hpp"
#include "estimates.hpp"
#include "judge.hpp"
#include "method.hpp"
#include "progress.hpp"
#include "shell.hpp"

#include <algorithm>
#include <cstdio>
#include <deque>
#include <optional>
#include <set>
#include <stdexcept>

namespace cli {

namespace {

// The same scene by another method, onto the page. A model that was made for another one does, where it offers the method and was not chosen
// by a budget, which may have taken other modes.
std::optional<Film> add_method(const Scene &scene, const Mesh &mesh, const std::vector<PlacedHandle> &handles, uint32_t n_frames,
                const shellwarp::Model &made, const RunOptions &options, Page &page) {
  std::optional<shellwarp::Model> own;
  if (!made.front().empty() || sw_model_offers(made.get(), scene.method) != SW_OK) own.emplace(make_model(scene, mesh, options.quiet));
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

}  // namespace

void add_to_page(const Scene &scene, const Mesh &mesh, const std::vector<PlacedHandle> &handles, uint32_t n_frames,
                 const Run &run, const Film &film, const std::vector<std::string> &words,
                 const shellwarp::Model &model, const RunOptions &options, Page &page) {
  const SwModelInfo info = model.info();
  page.add_shell(scene, mesh, handles, film);
  page.add_film(scene, run, film, words, label_of(scene, info));
  std::set<uint32_t> shown;
  std::deque<Film> films;
  const uint32_t taken = host::method_taken(scene.method, info);
  std::vector<Compared> all = {{host::method_name(taken), host::is_full_shell(taken), &film}};
  for (const std::string &name : options.compare) {
    Scene other = scene;
    other.method = *host::find_method(name);
    other.correction_steps = 0;
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

}  // namespace cli
