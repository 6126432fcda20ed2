#include "output_file.hpp"

#include <cerrno>
#include <cstdarg>
#include <cstring>
#include <stdexcept>
#include <system_error>

#ifdef _WIN32
#include <io.h>
#include <process.h>
#else
#include <unistd.h>
#endif

namespace cli {

namespace {

namespace fs = std::filesystem;

[[noreturn]] void cannot_write(const std::string &path, const std::string &why) {
  throw std::runtime_error("cannot write " + path + ": " + why);
}

#ifdef _WIN32
int process_id() { return _getpid(); }
bool bring_to_disk(std::FILE *file) { return _commit(_fileno(file)) == 0; }
bool may_write(const fs::path &path) { return _waccess(path.c_str(), 2) == 0; }
#else
int process_id() { return static_cast<int>(getpid()); }
bool bring_to_disk(std::FILE *file) { return fsync(fileno(file)) == 0 || errno == EINVAL; }  // EINVAL: it has no disk
bool may_write(const fs::path &path) { return access(path.c_str(), W_OK) == 0; }
#endif

// What a name stands for: a link's file is written where it lies, and the link stays.
fs::path behind_links(const fs::path &path) {
  std::error_code error;
  const fs::path target = fs::canonical(path, error);
  return error ? path : target;
}

}  // namespace

OutputFolder::OutputFolder(std::string directory, std::vector<std::string> inputs)
    : directory_(std::move(directory)), inputs_(std::move(inputs)) {
  std::error_code error;
  fs::create_directories(directory_, error);
  if (!error && !fs::is_directory(directory_, error)) error = std::make_error_code(std::errc::not_a_directory);
  if (error) throw std::runtime_error("cannot make the directory " + directory_ + ": " + error.message());
}

OutputFolder::~OutputFolder() {
  std::error_code ignored;
  for (const Begun &file : begun_) fs::remove(file.partial, ignored);
}

std::string OutputFolder::path(const std::string &name) const { return (fs::path(directory_) / name).string(); }

void OutputFolder::refuse_input(const fs::path &target) const {
  std::error_code missing;
  for (const std::string &input : inputs_)
    if (fs::equivalent(input, target, missing))
      cannot_write(target.string(), "it is the input " + input + "; choose another folder");
}

void OutputFolder::refuse_inputs(const std::function<bool(const std::string &)> &writes) const {
  std::error_code error;
  for (fs::directory_iterator entry(directory_, error), end; !error && entry != end; entry.increment(error))
    if (writes(entry->path().filename().string())) refuse_input(entry->path());
}

uintmax_t OutputFolder::free_bytes() const {
  std::error_code error;
  const fs::space_info space = fs::space(directory_, error);
  return error ? UINTMAX_MAX : space.available;
}

std::string OutputFolder::begin(const std::string &name) {
  const fs::path target = behind_links(path(name));
  refuse_input(target);
  if (fs::exists(target)) {  // a file that may not be written is not to be replaced either
    if (!fs::is_regular_file(target)) cannot_write(path(name), "something that is no file has this name");
    if (!may_write(target)) cannot_write(path(name), std::strerror(errno));
  }
  fs::path partial = target;
  partial += "." + std::to_string(process_id()) + ".partial";
  begun_.push_back({partial, target});
  return partial.string();
}

void OutputFolder::put_in_place() {
  for (; !begun_.empty(); begun_.pop_back()) {
    std::error_code error;
    fs::rename(begun_.back().partial, begun_.back().target, error);
    if (error) cannot_write(begun_.back().target.string(), error.message());
  }
}

OutputFile::OutputFile(OutputFolder &folder, const std::string &name)
    : path_(folder.path(name)), file_(std::fopen(folder.begin(name).c_str(), "wb"), std::fclose) {
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
  if (std::fflush(file_.get()) != 0 || !bring_to_disk(file_.get())) fail();
  if (std::fclose(file_.release()) != 0) fail();
}

void OutputFile::fail() const { cannot_write(path_, std::strerror(errno)); }

}  // namespace cli
