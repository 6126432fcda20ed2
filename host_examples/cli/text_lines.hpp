// Reading the words of a text file line by line, strictly: a word that is not what was asked for is an error that says where.
#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

namespace cli {

// "FILE:LINE: what is wrong"; line 0 means the file as a whole.
class FileError : public std::runtime_error {
public:
  FileError(const std::string &path, std::size_t line, const std::string &what);
};

// The whole file, or FileError with the system's reason.
std::string read_file(const std::string &path);

class TextLines {
public:
  // `contents` must outlive this; reading starts at byte `start`, which lies on line `line` (from 1). A byte order mark of UTF-8 is
  // passed over; one of UTF-16 or UTF-32 is a FileError.
  TextLines(const std::string &path, const std::string &contents, std::size_t start = 0, std::size_t line = 1);

  // Moves to the next line that holds a word, a line's rest after '#' counting as nothing. False at the end of the file.
  bool next_line();
  // Next word of this line; empty when there is none left.
  std::string_view word();
  bool has_word() const;

  // Next word as a finite number, a whole number, or an index; `what` names it in the message ("x of vertex 12").
  double number(const std::string &what);
  int64_t whole(const std::string &what);
  uint64_t index(const std::string &what);
  std::array<double, 3> point(const std::string &what);
  // The rest of this line: at most `most` numbers, which nobody needs.
  void pass_numbers(std::size_t most, const std::string &what);

  // Byte behind the present line.
  std::size_t position() const { return end_; }
  std::size_t line() const { return line_; }
  [[noreturn]] void fail(const std::string &what) const;

private:
  const std::string &path_;
  const std::string &contents_;
  std::size_t at_, end_;  // next unread byte of the line, and the byte behind the line
  std::size_t line_;
  std::size_t stop_ = 0;  // where the words of this line end: its end or a comment
};

// "found 'word'", or that there is none.
std::string found(std::string_view word);

// Bytes up to the end of the first line, its "\n", "\r\n" or "\r" included.
std::size_t line_length(std::string_view text);

// The whole of `word` as an integer; false if it is not one, or too large.
template <class Integer>
bool parse_whole(std::string_view word, Integer &value) {
  const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
  return result.ec == std::errc() && result.ptr == word.data() + word.size();
}

// The whole of `word` as a decimal number; false if it is not one, or not finite.
bool parse_number(std::string_view word, double &value);

}  // namespace cli
