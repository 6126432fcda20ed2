#include "output_file.hpp"

#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <stdexcept>

namespace cli {

OutputFile::OutputFile(const std::string &path) : path_(path), file_(std::fopen(path.c_str(), "wb"), std::fclose) {
  if (!file_) fail();
}

void OutputFile::write(const void *bytes, std::size_t size) {
  if (std::fwrite(bytes, 1, size, file_.get()) != size) fail();
}

void OutputFile::print(const char *format, ...) {
  std::va_list arguments;
  va_start(arguments, format);
  const int written = std::vfprintf(file_.get(), format, arguments);
  va_end(arguments);
  if (written < 0) fail();
}

void OutputFile::seek(long offset) {
  if (std::fseek(file_.get(), offset, SEEK_SET) != 0) fail();
}

void OutputFile::close() {
  if (std::fclose(file_.release()) != 0) fail();
}

void OutputFile::fail() const { throw std::runtime_error("cannot write " + path_ + ": " + std::strerror(errno)); }

}  // namespace cli
