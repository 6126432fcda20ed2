// What the library warns of while it makes a model.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace cli {

// Listens until its warnings are taken or it ends. One at a time: the library has one log.
class Warnings {
public:
  Warnings();
  ~Warnings();
  Warnings(const Warnings &) = delete;
  Warnings &operator=(const Warnings &) = delete;

  std::vector<std::string> taken();

private:
  static void add(void *self, uint32_t level, const char *message);

  std::vector<std::string> warnings_;
};

}  // namespace cli
