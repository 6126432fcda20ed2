#include "closest.hpp"

#include <algorithm>
#include <cctype>

namespace cli {

namespace {

std::string plain(const std::string &word) {
  std::string letters;
  for (const char c : word) letters += c == '-' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return letters.substr(std::min(letters.find_first_not_of('_'), letters.size()));
}

// Letters to insert, remove, replace or swap with the next one (optimal string alignment).
std::size_t edits(const std::string &a, const std::string &b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i)
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  return d[a.size()][b.size()];
}

// Half a word is a word that was cut short, as "bend" for "k_bend", or "mat" for "material".
bool holds(const std::string &whole, const std::string &part) {
  const std::size_t at = whole.find(part);
  return at != std::string::npos && part.size() >= (at == 0 ? 3 : 4);
}

}  // namespace

std::string closest(const std::string &word, const std::vector<std::string> &known) {
  const std::string wanted = plain(word);
  std::string best;
  std::size_t least = 1 + std::max<std::size_t>(wanted.size() / 3, 1);
  for (const std::string &candidate : known) {
    const std::string name = plain(candidate);
    const std::size_t distance = edits(wanted, name);
    if (distance >= least) continue;
    least = distance;
    best = candidate;
  }
  for (const std::string &candidate : known)
    if (best.empty() && (holds(plain(candidate), wanted) || holds(wanted, plain(candidate)))) best = candidate;
  return best;
}

std::string did_you_mean(const std::string &word, const std::vector<std::string> &known) {
  const std::string best = closest(word, known);
  return best.empty() ? "" : "; did you mean '" + best + "'?";
}

}  // namespace cli
