// What is said after a run, in sentences: what moved how far, how good that is, and what to change.
#pragma once

#include "summary.hpp"

#include <string>
#include <vector>

namespace cli {

// "moved: …", the verdict of the certificate, and "note: …" or "try: …" where something is to be known or changed.
std::vector<std::string> closing_words(const Summary &summary);

// What the estimates of the errors mean, a sentence; empty where there is nothing to say. `chosen`: the method is the automatic choice's.
// `compared`: it names no other method.
std::string verdict(const Run &run, bool chosen = false, bool compared = false);

// What a method gets wrong against the full shell, a share of the largest displacement of the frames that were judged; 0 where none was.
double method_error(const Run &run);

}  // namespace cli
