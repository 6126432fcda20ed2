// A file being written. Every failure, a full disk included, is an exception that names the file.
#pragma once

#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>

namespace cli {

class OutputFile {
public:
  explicit OutputFile(const std::string &path);

  void write(const void *bytes, std::size_t size);
  void print(const char *format, ...)
#if defined(__GNUC__)
      __attribute__((format(printf, 2, 3)))
#endif
      ;
  void seek(long offset);
  // Must be called for a file that is to be kept: what was buffered may fail to be written only now.
  void close();

private:
  [[noreturn]] void fail() const;

  std::string path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE *)> file_;
};

}  // namespace cli
