#include "moving_mesh.hpp"
#include "surface.hpp"

#include <algorithm>
#include <cctype>
#include <functional>

namespace cli {

namespace {

bool is_letter(char c) { return std::isalpha(static_cast<unsigned char>(c)) || c == '_'; }
bool is_part(char c) { return is_letter(c) || std::isdigit(static_cast<unsigned char>(c)); }

std::string identifier(std::string name) {
  for (char &c : name)
    if (!is_part(c)) c = '_';
  return "shell_" + name;
}

// The names of a path, from the root down.
std::vector<std::string> names_of(const std::string &prim) {
  std::vector<std::string> names;
  for (std::size_t at = 0; at < prim.size();) {
    const std::size_t end = std::min(prim.find('/', at + 1), prim.size());
    names.push_back(prim.substr(at + 1, end - at - 1));
    at = end;
  }
  return names;
}

class UsdText {
public:
  UsdText(OutputFolder &folder, const std::string &name, const MovingMesh &moving) : file_(folder, name), moving_(moving) {}

  void write(const std::string &name, const std::string &prim) {
    const std::vector<std::string> names = prim.empty() ? std::vector<std::string>{identifier(name)} : names_of(prim);
    header(names.front());
    for (std::size_t k = 0; k + 1 < names.size(); ++k) file_.print("over \"%s\"\n{\n", names[k].c_str());
    file_.print(prim.empty() ? "def Mesh \"%s\"\n{\n" : "over \"%s\"\n{\n", names.back().c_str());
    if (prim.empty())
      faces();
    else
      file_.print("uniform token[] xformOpOrder = [\"!resetXformStack!\"]\n");
    motion();
    for (std::size_t k = 0; k < names.size(); ++k) file_.print("}\n");
    file_.close();
  }

private:
  using Frame = MovingMesh::Frame;

  void header(const std::string &root) {
    file_.print("#usda 1.0\n(\n    defaultPrim = \"%s\"\n    metersPerUnit = %.17g\n    upAxis = \"%c\"\n", root.c_str(),
                moving_.metres_per_unit, moving_.up == 1 ? 'Y' : 'Z');
    file_.print("    startTimeCode = %u\n    endTimeCode = %u\n    timeCodesPerSecond = %.17g\n    framesPerSecond = %.17g\n)\n\n",
                moving_.frames.front().number, moving_.frames.back().number, moving_.frame_rate, moving_.frame_rate);
  }

  void numbers(const char *name, const std::vector<uint32_t> &values) {
    file_.print("int[] %s = [", name);
    for (std::size_t i = 0; i < values.size(); ++i) file_.print(i ? ", %u" : "%u", values[i]);
    file_.print("]");
  }

  void faces() {
    const Mesh &mesh = moving_.mesh;
    const Surface surface = surface_of(mesh);
    file_.print("uniform bool doubleSided = 1\nuniform token subdivisionScheme = \"none\"\n");
    numbers("faceVertexCounts", surface.counts);
    file_.print("\n");
    numbers("faceVertexIndices", surface.corners);
    file_.print("\n");
    if (surface.corner_uvs.empty()) return;
    file_.print("texCoord2f[] primvars:st = [");
    for (std::size_t i = 0; i < mesh.uvs.size(); i += 2)
      file_.print(i ? ", (%.9g, %.9g)" : "(%.9g, %.9g)", static_cast<double>(mesh.uvs[i]), static_cast<double>(mesh.uvs[i + 1]));
    file_.print("] (\n    interpolation = \"faceVarying\"\n)\n");
    numbers("primvars:st:indices", surface.corner_uvs);
    file_.print("\n");
  }

  void vectors(const std::vector<float> &values) {
    for (std::size_t i = 0; i < values.size(); i += 3)  // nine digits bring a float back exactly
      file_.print(i ? ", (%.9g, %.9g, %.9g)" : "(%.9g, %.9g, %.9g)", static_cast<double>(values[i]),
                  static_cast<double>(values[i + 1]), static_cast<double>(values[i + 2]));
  }

  void samples(const char *attribute, const std::function<std::vector<float>(const Frame &)> &of) {
    file_.print("%s.timeSamples = {\n", attribute);
    for (const Frame &frame : moving_.frames) {
      file_.print("%u: [", frame.number);
      vectors(of(frame));
      file_.print("],\n");
    }
    file_.print("}\n");
  }

  void motion() {
    samples("float3[] extent", [](const Frame &frame) {
      std::vector<float> box(frame.positions.begin(), frame.positions.begin() + 3);
      box.insert(box.end(), box.begin(), box.end());
      for (std::size_t i = 0; i < frame.positions.size(); ++i) {
        box[i % 3] = std::min(box[i % 3], frame.positions[i]);
        box[3 + i % 3] = std::max(box[3 + i % 3], frame.positions[i]);
      }
      return box;
    });
    samples("point3f[] points", [](const Frame &frame) { return frame.positions; });
    if (!moving_.frames.front().velocities.empty())
      samples("vector3f[] velocities", [](const Frame &frame) { return frame.velocities; });
    file_.print("normal3f[] normals (\n    interpolation = \"vertex\"\n)\n");
    samples("normal3f[] normals",
            [this](const Frame &frame) { return vertex_normals(frame.positions, moving_.mesh.triangles); });
  }

  OutputFile file_;
  const MovingMesh &moving_;
};

}  // namespace

void write_usd(OutputFolder &folder, const std::string &name, const std::string &prim, const MovingMesh &moving) {
  UsdText(folder, name + ".usda", moving).write(name, prim);
}

std::string wrong_prim(const std::string &prim) {
  if (prim.empty() || prim[0] != '/') return "it must begin with '/', as in /World/leaf";
  for (const std::string &name : names_of(prim)) {
    if (name.empty()) return "a name in it is empty";
    if (!is_letter(name[0]) || !std::all_of(name.begin(), name.end(), is_part))
      return "'" + name + "' is no name of a prim: letters, digits and _, no digit first";
  }
  return "";
}

}  // namespace cli
