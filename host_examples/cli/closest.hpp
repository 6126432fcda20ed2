// "did you mean …?": the known word that a misspelt one is next to.
#pragma once

#include <string>
#include <vector>

namespace cli {

// The nearest of the words, dashes and underscores being the same; empty where none is near.
std::string closest(const std::string &word, const std::vector<std::string> &known);

// "; did you mean 'WORD'?", or empty.
std::string did_you_mean(const std::string &word, const std::vector<std::string> &known);

}  // namespace cli
