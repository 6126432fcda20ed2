// One deforming object in a host: builds when it must, steps when time goes on, looks up when time goes back.
//
// Frames are counted from the start frame. What a frame's evaluation does:
//
//   at or before the start  the shell is at rest where the object stands
//   the frame after one reached   one step, with the inputs of now
//   a frame reached before  its saved state, bit for bit, if its inputs are what they were; else it is stepped to anew and
//                           what came after it is forgotten
//   a frame further on      steps from the last one reached with the inputs of now, the frame having stood there all along;
//                           exact only where the inputs have not changed meanwhile (Notes::jumped tells)
//   a frame behind the last under a rest shape that moves   the way there again: a saved state has no velocity of that shape
//   between two frames      a part of a step on a copy, which is thrown away: motion blur advances nothing
//
// Damping, frequency, method, start frame, frame rate and the number of colliders belong to the whole run: a change runs it again from the start.
// Vertices' connections, supports, material, modes and what the method needs belong to the model: a change builds it again. The rest
// shape is what came in first, and is looked at again at the start frame only, so that moving points upstream do
// not rebuild.
#pragma once

#include "collider_set.hpp"
#include "follower.hpp"
#include "frames_file.hpp"
#include "proxy_maker.hpp"
#include "message.hpp"
#include "notes.hpp"
#include "request.hpp"
#include "shell_model.hpp"
#include "state_cache.hpp"
#include "support_places.hpp"

#include <memory>
#include <optional>
#include <string>

namespace host {

class ShellRunner {
public:
  // Throws std::exception with a message for the user. The result is then as it was before.
  void evaluate(Request request);

  // Rest shape and result of what is drawn in the object's space, n x 3. Empty before the first evaluation.
  const std::vector<double> &rest() const;
  const std::vector<double> &deformed() const { return deformed_; }
  // The result stands for all that came in; else its way from rest is added to that.
  bool replaces() const { return replaces_; }
  // In the object's space and the scene's seconds, without the object's own motion. Empty where not asked for.
  const std::vector<double> &velocities() const { return velocities_; }

  uint64_t bytes() const;  // of model, frames and binding

  // What Notes::certified is, of the frame that was shown last. Throws HostError where there is none.
  std::string certificate(const std::function<bool()> &interrupted = {}) const;

  // All frames that are there, with the model. Throws HostError where there are none.
  Frames frames() const;
  // Those of before, in place of all that is there: taken at the next evaluation whose mesh and settings they are of.
  void adopt(Frames frames);

  const Notes &notes() const { return notes_; }
  const StateCache &cache() const { return cache_; }

private:
  struct At;

  void run(Request &request, const At &at);
  void find_patches(Request &request, const At &at);
  void find_sag_gravity(Request &request, const At &at);
  void follow(const Request &request, const At &at, bool built);
  bool take_stored(const Mesh &mesh, const Request &request, const At &at);
  bool model_serves(const Request &request, const At &at) const;
  void build(const Request &request, const At &at);
  void build_support_fields(Request &request, const At &at, const std::string &apart);
  void replay(const Request &request, const std::vector<StateCache::Entry> &before);
  void prepare_state(Request &request);
  void check_led(const Request &request) const;
  void move_supports(Request &request, const At &at);
  void restart(const Request &request);
  void begin(const Request &request, const Inputs &inputs, uint64_t key, bool exact);
  void reach(const Request &request, uint64_t frame, bool own_inputs);
  void load(const StateCache::Entry &entry, const Inputs &inputs);
  void return_to(const Request &request, uint64_t frame);
  void step_to(const Request &request, uint64_t frame, uint64_t key);
  void advance(const Request &request, const Inputs &inputs, uint64_t key, uint64_t frame, bool exact, bool teleport);
  void correct(const Request &request);
  void show(const Request &request, const At &at);
  bool step(shellwarp::State &state, const Inputs &inputs, double frames, bool teleport) const;  // as stand
  bool stand(shellwarp::State &state, const Inputs &inputs, bool teleport) const;  // true: supports were moved
  std::shared_ptr<const Inputs> seen(const Inputs &inputs, uint64_t frame, uint64_t key) const;
  void blow(shellwarp::State &state, const Wind &wind) const;
  void pull(shellwarp::State &state, const Inputs &inputs) const;
  void place_handles(shellwarp::State &state, const Inputs &inputs) const;
  Pose place_of(const Inputs &inputs) const;  // of the object's axes in the library's world
  SwFrameDesc frame_of(const Inputs &inputs) const;
  void read(const shellwarp::State &state, const Request &request, const At &at);
  void to_object(const Request &request, const At &at, std::vector<double> &points, std::vector<double> &velocities) const;

  std::shared_ptr<const ShellModel> model_;
  uint64_t build_key_ = 0, rest_key_ = 0, motion_key_ = 0;

  std::optional<shellwarp::State> state_;
  StateCache cache_;
  ColliderSet colliders_;
  ProxyMaker proxy_;
  Follower follower_;
  SupportPlaces places_;
  bool stored_serves_ = false;         // the model is that of the frames on disk
  bool needs_support_fields_ = false;  // supports have moved against each other
  std::vector<uint32_t> near_;         // patches that were found near colliders
  uint64_t near_key_ = 0, near_place_ = 0;  // for what mesh and settings, and where all was
  std::optional<Vec3> sag_gravity_;    // as Stiffness has it
  bool other_solids_ = false;          // than the state has
  bool led_ = false;                   // supports were moved in the state
  bool replaces_ = false;
  uint32_t correction_steps_ = 0;      // of the request
  uint32_t shown_steps_ = 0;           // those of what was shown last: none up to the start
  uint64_t live_ = 0;                  // the frame that the state has come to by itself; kLoaded: it was loaded
  static constexpr uint64_t kLoaded = ~uint64_t{0};
  std::vector<unsigned char> fresh_;   // the state before all
  uint64_t drawn_key_ = 0, faces_key_ = 0;
  std::unique_ptr<Frames> stored_;     // to be adopted
  double clock_ = 1;       // the library's seconds in one of the scene's
  double frame_time_ = 0;  // s of the scene
  double unit_ = 1;        // world lengths in one of the object's, as at the start

  std::vector<double> deformed_, velocities_;
  uint32_t missed_ = 0, method_ = 0;
  float deepest_ = 0;
  Notes notes_;
};

}  // namespace host
