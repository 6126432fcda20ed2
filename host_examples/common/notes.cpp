#include "notes.hpp"

#include "message.hpp"

#include <cmath>

namespace host {

std::string Notes::warning() const {
  std::string text;
  const auto say = [&text](const std::string &line) { text += (text.empty() ? "" : "\n") + line; };
  if (!turn_in_range)
    say("the shell turns by " + number(std::round(max_rotation * 57.29577951308232)) + " degrees, " +
        number(std::ceil(100 * turned_too_far)) + " % of it beyond the quarter turn within which the method's turns hold");
  if (handles_missed)
    say(number(uint64_t(handles_missed)) + " of the handles' holds cannot be met; more modes or a compliance may help");
  if (jumped) say("not simulated: frames were skipped while something moved; play from the start frame");
  if (floats) say("nothing holds the shell: paint supports, or it falls");
  if (supports_missed > kMissed)
    say("the shell beside the supports is " + number(std::round(1000 * supports_missed) / 10) +
        " % of its size off them: more support fields");
  if (rest_stretched > kStretched)
    say("the rest shape's edges have changed by " + number(std::round(100 * rest_stretched)) + " %, which the shell's stiffness does not know of");
  if (!maps_unused.empty()) say("these maps do nothing with this kind of stiffness: " + maps_unused);
  if (!uncalibrated.empty()) say("the proxy is not as stiff as the mesh that it stands for: " + uncalibrated);
  if (inside > kInside)
    say("the shell is " + number(std::round(1000 * inside) / 10) + " % of its size inside a collider: more modes, contact patches, or pushing it out for the eye");
  if (stored_of_others) say("the frames on disk are of another mesh, or of other settings: play from the start frame, and write them again");
  if (!certified.empty()) say(certified);
  return text;
}

}  // namespace host
