// Files being written: whole under their names, or not there at all. Every failure, a full disk included, is an exception that
// names the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace cli {

// The folder that a run writes to. Its files lie beside their names, as NAME.1234.partial, until all of them are put in place.
class OutputFolder {
public:
  // Makes the folder where it is missing. A file of `inputs` is never replaced, by whatever name or link.
  explicit OutputFolder(std::string directory, std::vector<std::string> inputs = {});
  // Removes what was not put in place.
  ~OutputFolder();
  OutputFolder(const OutputFolder &) = delete;
  OutputFolder &operator=(const OutputFolder &) = delete;

  std::string path(const std::string &name) const;
  // Fails where the folder holds an input under a name that the run will write. To be asked before the long work.
  void refuse_inputs(const std::function<bool(const std::string &name)> &writes) const;
  // Bytes that may still be written there; all there can be where the system does not say.
  uintmax_t free_bytes() const;
  // Where to write the file of that name until it is put in place.
  std::string begin(const std::string &name);
  // Gives all files begun since the last time their names. They must be closed.
  void put_in_place();

private:
  struct Begun {
    std::filesystem::path partial, target;
  };

  void refuse_input(const std::filesystem::path &target) const;

  std::string directory_;
  std::vector<std::string> inputs_;
  std::vector<Begun> begun_;
};

class OutputFile {
public:
  OutputFile(OutputFolder &folder, const std::string &name);

  void write(const void *bytes, std::size_t size);
  void print(const char *format, ...)
#if defined(__GNUC__)
      __attribute__((format(printf, 2, 3)))
#endif
      ;
  void seek(long offset);
  // Brings all to the disk. Must be called before the folder puts its files in place: what was buffered may fail only now.
  void close();

private:
  [[noreturn]] void fail() const;

  std::string path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE *)> file_;
};

}  // namespace cli
