#include "frames_file.hpp"

#include "hash.hpp"
#include "message.hpp"

#include <cstdio>
#include <cstring>
#include <memory>

namespace host {

namespace {

constexpr char kMagic[8] = {'S', 'W', 'F', 'R', 'A', 'M', 'E', '3'};

class Writer {
public:
  template <class T>
  void number(T value) {
    unsigned char raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof value);
    bytes.insert(bytes.end(), raw, raw + sizeof value);
  }
  void list(const std::vector<unsigned char> &values) {
    number(static_cast<uint64_t>(values.size()));
    bytes.insert(bytes.end(), values.begin(), values.end());
  }

  std::vector<unsigned char> bytes;
};

class Reader {
public:
  Reader(const std::vector<unsigned char> &bytes, const std::string &path) : bytes_(bytes), path_(path) {}

  template <class T>
  T number() {
    T value;
    std::memcpy(&value, take(sizeof value), sizeof value);
    return value;
  }
  std::vector<unsigned char> list() {
    const uint64_t size = number<uint64_t>();
    const unsigned char *from = take(size);
    return {from, from + size};
  }
  [[noreturn]] void fail() const { throw HostError(path_ + " is damaged, or has no frames of a shell"); }

private:
  const unsigned char *take(uint64_t size) {
    if (size > bytes_.size() - at_) fail();
    at_ += size;
    return bytes_.data() + at_ - size;
  }

  const std::vector<unsigned char> &bytes_;
  const std::string &path_;
  uint64_t at_ = 0;
};

using File = std::unique_ptr<std::FILE, int (*)(std::FILE *)>;

uint64_t sum_of(const std::vector<unsigned char> &bytes) { return Hash().add_all(bytes).value(); }

std::vector<unsigned char> contents_of(const std::string &path) {
  const File file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) throw HostError("cannot read the frames in " + path);
  std::vector<unsigned char> bytes;
  unsigned char part[1 << 16];
  for (std::size_t n; (n = std::fread(part, 1, sizeof part, file.get())) > 0;) bytes.insert(bytes.end(), part, part + n);
  if (std::ferror(file.get())) throw HostError("cannot read the frames in " + path);
  return bytes;
}

}  // namespace

void write_frames(const std::string &path, const Frames &frames) {
  Writer out;
  out.bytes.assign(kMagic, kMagic + sizeof kMagic);
  out.number(frames.build_key), out.number(frames.motion_key), out.number(frames.method);
  out.number(static_cast<uint8_t>(frames.support_fields)), out.number(frames.unit);
  out.number(frames.near_key), out.number(static_cast<uint64_t>(frames.near.size()));
  for (const uint32_t v : frames.near) out.number(v);
  out.number(static_cast<uint64_t>(frames.rest.size()));
  for (const double x : frames.rest) out.number(x);
  out.list(frames.model);
  out.number(static_cast<uint64_t>(frames.entries.size()));
  for (const StateCache::Entry &entry : frames.entries) {
    out.list(entry.state);
    out.number(entry.inputs), out.number(entry.missed);
    out.number(static_cast<uint8_t>(entry.exact)), out.number(static_cast<uint8_t>(entry.led)), out.number(entry.deepest), out.number(entry.stiffness);
  }
  out.number(sum_of(out.bytes));
  const std::string beside = path + ".partial";
  File file(std::fopen(beside.c_str(), "wb"), &std::fclose);
  const bool written = file && std::fwrite(out.bytes.data(), 1, out.bytes.size(), file.get()) == out.bytes.size();
  if (!written || std::fclose(file.release()) != 0) {
    file.reset();
    std::remove(beside.c_str());
    throw HostError("cannot write the frames to " + path);
  }
  std::remove(path.c_str());  // Windows does not replace
  if (std::rename(beside.c_str(), path.c_str()) != 0) throw HostError("cannot write the frames to " + path);
}

Frames read_frames(const std::string &path) {
  std::vector<unsigned char> bytes = contents_of(path);
  const Reader broken(bytes, path);
  if (bytes.size() < sizeof kMagic + sizeof(uint64_t) || std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0) broken.fail();
  uint64_t sum;
  std::memcpy(&sum, bytes.data() + bytes.size() - sizeof sum, sizeof sum);
  bytes.resize(bytes.size() - sizeof sum);
  if (sum != sum_of(bytes)) broken.fail();
  bytes.erase(bytes.begin(), bytes.begin() + sizeof kMagic);
  Reader in(bytes, path);
  Frames frames;
  frames.build_key = in.number<uint64_t>(), frames.motion_key = in.number<uint64_t>(), frames.method = in.number<uint32_t>();
  frames.support_fields = in.number<uint8_t>() != 0, frames.unit = in.number<double>();
  frames.near_key = in.number<uint64_t>();
  const uint64_t n_near = in.number<uint64_t>();
  for (uint64_t i = 0; i < n_near; ++i) frames.near.push_back(in.number<uint32_t>());
  const uint64_t n_rest = in.number<uint64_t>();
  for (uint64_t i = 0; i < n_rest; ++i) frames.rest.push_back(in.number<double>());
  frames.model = in.list();
  const uint64_t n = in.number<uint64_t>();
  for (uint64_t k = 0; k < n; ++k) {
    StateCache::Entry entry;
    entry.state = in.list();
    entry.inputs = in.number<uint64_t>(), entry.missed = in.number<uint32_t>();
    entry.exact = in.number<uint8_t>() != 0, entry.led = in.number<uint8_t>() != 0, entry.deepest = in.number<float>();
    entry.stiffness = in.number<float>();
    frames.entries.push_back(std::move(entry));
  }
  return frames;
}

}  // namespace host
