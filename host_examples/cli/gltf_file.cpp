#include "json.hpp"
#include "judge.hpp"
#include "moving_mesh.hpp"
#include "surface.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <stdexcept>
#include <utility>

namespace cli {

namespace {

constexpr uint32_t kFloat = 5126, kUnsigned = 5125, kVertices = 34962, kIndices = 34963;  // of glTF
constexpr double kMostBytes = 4294967295.0;  // a GLB counts them in 32 bits

// Vertices of glTF have one texture coordinate each: those of the mesh, once for every coordinate that they have.
struct Vertices {
  std::vector<uint32_t> of_mesh, uvs, indices;
};

Vertices vertices_of(const Mesh &mesh) {
  Vertices all;
  if (mesh.corner_uvs.empty()) {
    for (uint32_t v = 0; v < mesh.n_vertices(); ++v) all.of_mesh.push_back(v);
    all.indices = mesh.triangles;
    return all;
  }
  const Surface surface = surface_of(mesh);
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> known;
  for (std::size_t face = 0, first = 0; face < surface.counts.size(); first += surface.counts[face++]) {
    std::map<uint32_t, uint32_t> number;  // here, of the face's vertices
    for (std::size_t k = first; k < first + surface.counts[face]; ++k) {
      const std::pair<uint32_t, uint32_t> key = {surface.corners[k], surface.corner_uvs[k]};
      const auto [at, is_new] = known.emplace(key, static_cast<uint32_t>(all.of_mesh.size()));
      if (is_new) {
        all.of_mesh.push_back(key.first);
        all.uvs.push_back(key.second);
      }
      number[key.first] = at->second;
    }
    const uint32_t *corners = &mesh.triangles[3 * surface.triangles[face]];
    for (std::size_t k = 0; k < 3 * std::size_t{surface.counts[face] - 2}; ++k) all.indices.push_back(number.at(corners[k]));
  }
  return all;
}

class GltfFile {
public:
  explicit GltfFile(const MovingMesh &moving) : moving_(moving), vertices_(vertices_of(moving.mesh)) {
    const double n = static_cast<double>(vertices_.of_mesh.size()), frames = static_cast<double>(moving.frames.size());
    const double bytes = 24 * n * frames + 4 * frames * frames + 4.0 * static_cast<double>(vertices_.indices.size()) + 600 * frames;
    if (bytes > kMostBytes)
      throw std::runtime_error(format("glTF: %.0f frames of %.0f vertices take %.4g GB in one file of at most 4.29", frames, n, bytes / 1e9));
    bytes_.reserve(static_cast<std::size_t>(bytes));
  }

  void write(OutputFolder &folder, const std::string &name) {
    std::string json = text(name);
    while (json.size() % 4) json += ' ';
    OutputFile file(folder, name + ".glb");
    std::vector<unsigned char> head;
    const auto put = [&head](std::size_t word) {
      for (int k = 0; k < 4; ++k) head.push_back(static_cast<unsigned char>(word >> (8 * k)));
    };
    put(0x46546c67), put(2), put(28 + json.size() + bytes_.size());  // "glTF", version, length
    put(json.size()), put(0x4e4f534a);                               // "JSON"
    file.write(head.data(), head.size());
    file.write(json.data(), json.size());
    head.clear();
    put(bytes_.size()), put(0x004e4942);  // "BIN"
    file.write(head.data(), head.size());
    file.write(bytes_.data(), bytes_.size());
    file.close();
  }

private:
  std::string text(const std::string &name) {
    const std::string indices = put_indices(), uvs = vertices_.uvs.empty() ? "" : ",\"TEXCOORD_0\":" + put_uvs();
    const std::string targets = put_frames(), animation = put_animation();
    std::string json = "{\"asset\":{\"version\":\"2.0\",\"generator\":\"shellwarp\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"name\":" +
                       json_text(name) + ",\"mesh\":0" + placed() + "}],";
    json += "\"materials\":[{\"doubleSided\":true,\"pbrMetallicRoughness\":{\"metallicFactor\":0,\"roughnessFactor\":0.8}}],";
    json += "\"meshes\":[{\"name\":" + json_text(name) + ",\"primitives\":[{\"attributes\":{\"POSITION\":" + base_[0] + ",\"NORMAL\":" +
            base_[1] + uvs + "},\"indices\":" + indices + ",\"material\":0" + targets + "}]" + weights() + "}]," + animation;
    return json + "\"accessors\":[" + accessors_ + "],\"bufferViews\":[" + views_ + "],\"buffers\":[{\"byteLength\":" +
           std::to_string(bytes_.size()) + "}]}";
  }

  // glTF has metres, and y upward.
  std::string placed() const {
    std::string words;
    if (moving_.up == 2) words += ",\"rotation\":[-0.70710678118654752,0,0,0.70710678118654752]";
    if (moving_.up == 0) words += ",\"rotation\":[0,0,0.70710678118654752,0.70710678118654752]";
    const std::string s = json_number(moving_.metres_per_unit);
    return moving_.metres_per_unit == 1 ? words : words + ",\"scale\":[" + s + "," + s + "," + s + "]";
  }

  void word(uint32_t value) {
    for (int k = 0; k < 4; ++k) bytes_.push_back(static_cast<unsigned char>(value >> (8 * k)));
  }
  void number(float value) {
    uint32_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    word(bits);
  }

  // The bytes from `start` on; the view's number.
  std::size_t view(std::size_t start, const std::string &more) {
    views_ += (n_views_ ? "," : "") + format("{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu", start, bytes_.size() - start) + more + "}";
    return n_views_++;
  }

  std::string accessor(std::size_t view, std::size_t offset, uint32_t component, std::size_t count, const char *type, const std::string &more = "") {
    accessors_ += (n_accessors_ ? "," : "") + format("{\"bufferView\":%zu,\"byteOffset\":%zu,\"componentType\":%u,\"count\":%zu,\"type\":\"%s\"",
                                                     view, offset, component, count, type) + more + "}";
    return std::to_string(n_accessors_++);
  }

  std::string put_indices() {
    const std::size_t start = bytes_.size();
    for (const uint32_t i : vertices_.indices) word(i);
    return accessor(view(start, format(",\"target\":%u", kIndices)), 0, kUnsigned, vertices_.indices.size(), "SCALAR");
  }

  std::string put_uvs() {
    const std::size_t start = bytes_.size();
    for (const uint32_t i : vertices_.uvs) number(moving_.mesh.uvs[2 * std::size_t{i}]), number(1 - moving_.mesh.uvs[2 * std::size_t{i} + 1]);
    return accessor(view(start, format(",\"byteStride\":8,\"target\":%u", kVertices)), 0, kFloat, vertices_.uvs.size(), "VEC2");
  }

  // The vertices' values less those of `base`, with the least and the largest of each axis.
  std::string put_vectors(const std::vector<float> &values, const std::vector<float> *base, std::size_t start, bool bounded) {
    float low[3] = {}, high[3] = {};
    const std::size_t offset = bytes_.size() - start;
    for (std::size_t i = 0; i < vertices_.of_mesh.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t at = 3 * std::size_t{vertices_.of_mesh[i]} + c;
        const float value = base ? values[at] - (*base)[at] : values[at];
        low[c] = i ? std::min(low[c], value) : value;
        high[c] = i ? std::max(high[c], value) : value;
        number(value);
      }
    std::string more;
    if (bounded)
      more = ",\"min\":" + json_numbers({low[0], low[1], low[2]}) + ",\"max\":" + json_numbers({high[0], high[1], high[2]});
    return accessor(n_views_, offset, kFloat, vertices_.of_mesh.size(), "VEC3", more);  // the view is told when it is whole
  }

  // The first frame, and what each other one differs by: the primitive's targets.
  std::string put_frames() {
    const std::vector<MovingMesh::Frame> &frames = moving_.frames;
    const std::size_t start = bytes_.size();
    const std::vector<float> normals = vertex_normals(frames[0].positions, moving_.mesh.triangles);
    base_[0] = put_vectors(frames[0].positions, nullptr, start, true);
    base_[1] = put_vectors(normals, nullptr, start, false);
    std::string targets;
    for (std::size_t k = 1; k < frames.size(); ++k) {
      const std::string position = put_vectors(frames[k].positions, &frames[0].positions, start, true);
      targets += (k > 1 ? "," : "") + ("{\"POSITION\":" + position) + ",\"NORMAL\":" +
                 put_vectors(vertex_normals(frames[k].positions, moving_.mesh.triangles), &normals, start, false) + "}";
    }
    view(start, format(",\"byteStride\":12,\"target\":%u", kVertices));
    return targets.empty() ? "" : ",\"targets\":[" + targets + "]";
  }

  std::string weights() const {
    std::string zeros;
    for (std::size_t k = 1; k < moving_.frames.size(); ++k) zeros += k > 1 ? ",0" : "0";
    return zeros.empty() ? "" : ",\"weights\":[" + zeros + "]";
  }

  std::string put_animation() {
    const std::vector<MovingMesh::Frame> &frames = moving_.frames;
    if (frames.size() < 2) return "";
    std::size_t start = bytes_.size();
    for (const MovingMesh::Frame &frame : frames) number(static_cast<float>(frame.seconds));
    const std::string bounds = ",\"min\":[" + json_number(static_cast<float>(frames.front().seconds)) + "],\"max\":[" +
                               json_number(static_cast<float>(frames.back().seconds)) + "]";
    const std::string times = accessor(view(start, ""), 0, kFloat, frames.size(), "SCALAR", bounds);
    start = bytes_.size();
    for (std::size_t j = 0; j < frames.size(); ++j)
      for (std::size_t k = 1; k < frames.size(); ++k) number(j == k ? 1.0f : 0.0f);
    const std::string values = accessor(view(start, ""), 0, kFloat, frames.size() * (frames.size() - 1), "SCALAR");
    return "\"animations\":[{\"samplers\":[{\"input\":" + times + ",\"output\":" + values +
           "}],\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"weights\"}}]}],";
  }

  const MovingMesh &moving_;
  const Vertices vertices_;
  std::vector<unsigned char> bytes_;
  std::string views_, accessors_, base_[2];
  std::size_t n_views_ = 0, n_accessors_ = 0;
};

}  // namespace

void write_gltf(OutputFolder &folder, const std::string &name, const MovingMesh &moving) {
  GltfFile(moving).write(folder, name);
}

}  // namespace cli
