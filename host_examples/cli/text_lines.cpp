#include "text_lines.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

namespace cli {

namespace {

constexpr std::string_view kBlank = " \t\r\n\v\f";

std::string located(const std::string &path, std::size_t line, const std::string &what) {
  return path + (line ? ":" + std::to_string(line) : "") + ": " + what;
}

// At most `limit` bytes of a word, control characters shown as '?': the file may hold anything.
std::string printable(std::string_view word, std::size_t limit = 40) {
  std::string text(word.substr(0, limit));
  for (char &c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return text + (word.size() > limit ? "…" : "");
}

}  // namespace

std::string found(std::string_view word) { return word.empty() ? "the line ends" : "found '" + printable(word) + "'"; }

FileError::FileError(const std::string &path, std::size_t line, const std::string &what)
    : std::runtime_error(located(path, line, what)) {}

std::string read_file(const std::string &path) {
  // stdio, because its failures (a directory, a bad disk) come as errno and not as an exception of the library's choice.
  const std::unique_ptr<std::FILE, int (*)(std::FILE *)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file) throw FileError(path, 0, std::string("cannot read: ") + std::strerror(errno));
  std::string contents;
  char chunk[65536];
  while (const std::size_t size = std::fread(chunk, 1, sizeof chunk, file.get())) contents.append(chunk, size);
  if (std::ferror(file.get())) throw FileError(path, 0, std::string("cannot read: ") + std::strerror(errno));
  return contents;
}

TextLines::TextLines(const std::string &path, const std::string &contents, std::size_t start, std::size_t line)
    : path_(path), contents_(contents), at_(start), end_(start), line_(line - 1) {
  if (start > 0) return;
  const auto begins_with = [&](std::string_view mark) {
    return std::string_view(contents_).substr(0, mark.size()) == mark;
  };
  if (begins_with("\xff\xfe") || begins_with("\xfe\xff") || begins_with(std::string_view("\0\0\xfe\xff", 4)))
    throw FileError(path, 0, "is text in UTF-16 or UTF-32; save it as UTF-8");
  if (begins_with("\xef\xbb\xbf")) at_ = end_ = 3;
}

bool TextLines::next_line() {
  while (end_ < contents_.size()) {
    at_ = end_;
    end_ += line_length(std::string_view(contents_).substr(end_));
    const std::size_t comment = std::string_view(contents_).substr(at_, end_ - at_).find('#');  // of this line: a file without any is not searched for it
    stop_ = comment == std::string_view::npos ? end_ : at_ + comment;
    ++line_;
    at_ = std::min(contents_.find_first_not_of(kBlank, at_), stop_);
    if (at_ < stop_) return true;
  }
  return false;
}

std::string_view TextLines::word() {
  const std::size_t begin = std::min(contents_.find_first_not_of(kBlank, at_), stop_);
  at_ = std::min(contents_.find_first_of(kBlank, begin), stop_);
  return std::string_view(contents_).substr(begin, at_ - begin);
}

bool TextLines::has_word() const { return contents_.find_first_not_of(kBlank, at_) < stop_; }

double TextLines::number(const std::string &what) {
  const std::string_view text = word();
  double value = 0;
  if (!parse_number(text, value)) fail(what + " must be a finite number; " + found(text));
  return value;
}

uint64_t TextLines::index(const std::string &what) {
  const std::string_view text = word();
  uint64_t value = 0;
  if (!parse_whole(text, value)) fail(what + " must be a whole number, 0 or more; " + found(text));
  return value;
}

int64_t TextLines::whole(const std::string &what) {
  const std::string_view text = word();
  int64_t value = 0;
  if (!parse_whole(text, value)) fail(what + " must be a whole number; " + found(text));
  return value;
}

std::array<double, 3> TextLines::point(const std::string &what) {
  std::array<double, 3> x{};
  const char *names[] = {"x of ", "y of ", "z of "};
  for (std::size_t k = 0; k < 3; ++k) x[k] = number(names[k] + what);
  return x;
}

void TextLines::pass_numbers(std::size_t most, const std::string &what) {
  std::size_t count = 0;
  for (; has_word(); ++count) {
    if (count == most)
      fail("more than " + std::to_string(most) + " numbers follow " + what + "; is a line end missing?");
    number("what follows " + what);
  }
}

void TextLines::fail(const std::string &what) const { throw FileError(path_, line_, what); }

std::size_t line_length(std::string_view text) {
  const std::size_t end = text.find_first_of("\r\n");
  if (end == std::string_view::npos) return text.size();
  return end + (text.substr(end, 2) == "\r\n" ? 2 : 1);
}

bool parse_number(std::string_view word, double &value) {
  // strtod also knows hexadecimal numbers, "inf" and "nan".
  if (word.empty() || word.find_first_not_of("0123456789+-.eE") != std::string_view::npos) return false;
  // A copy, because strtod needs an end that it can see; std::from_chars for double is not in every C++17 library.
  const std::string text(word);
  char *end = nullptr;
  value = std::strtod(text.c_str(), &end);
  return end == text.c_str() + text.size() && std::isfinite(value);
}

}  // namespace cli
