// What is said after a run, in sentences: what moved how far, how good that is, and what to change.
#pragma once

#include "summary.hpp"

#include <string>
#include <vector>

namespace cli {

// "moved: …", the verdict of the certificate, and "note: …" or "try: …" where something is to be known or changed.
std::vector<std::string> closing_words(const Summary &summary);

// What the estimate of the last frame's error means, a sentence; empty where there is nothing to say.
std::string verdict(const Run &run);

}  // namespace cli
