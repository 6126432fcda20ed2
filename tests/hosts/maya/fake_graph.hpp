// A dependency graph as small as can be: plug-ins are loaded as Maya loads them, nodes made, attributes set by name, meshes
// wired in and outputs asked for. An output is computed only when something that was declared to affect it has changed.
#pragma once

#include "fake_maya.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace fake {

// Everything that Maya would show or was told.
struct Session {
  std::vector<std::string> errors, warnings, commands;
  int interrupt_polls = 0, computations_open = 0;
  int interrupt_at = 0;  // the poll at which the user presses Esc; 0 = never
};
Session &session();

struct Mesh {
  std::vector<MPoint> points;
  std::vector<int> counts, corners;
};

class Plugin {
public:
  explicit Plugin(const std::string &path);  // dlopen, initializePlugin; throws
  ~Plugin();                                 // uninitializePlugin, dlclose
  Plugin(const Plugin &) = delete;
  Plugin &operator=(const Plugin &) = delete;

private:
  void *library_ = nullptr;
};

struct AttributeInfo {
  std::string name, brief, parent;
  bool keyable, is_array, affects_output, paintable;
  std::map<std::string, int> fields;  // of an enum
};

class Deformer {
public:
  explicit Deformer(const std::string &type_name);
  ~Deformer();

  // "frequency", "gravityY", "handles[2].handleVertex", "supportWeightList[0].supportWeights[7]". Throws where there is no such
  // attribute, or the value is below its minimum or above its maximum.
  void set(const std::string &plug, double value);
  void set(const std::string &plug, const MMatrix &value);
  void set_time(double value, MTime::Unit unit);
  void set_components(const std::string &plug, const std::vector<int> &vertices, bool edges = false);
  void set_mesh(const std::string &plug, const Mesh *mesh);  // what is connected; NULL: no more
  void remove(const std::string &plug);                      // an array's element

  // The geometry at an index; NULL: something that is no mesh. The members of the deformer's set are all vertices, or these.
  void connect(unsigned int index, const Mesh *mesh);
  void set_members(unsigned int index, std::vector<int> members);
  void set_world_matrix(unsigned int index, const MMatrix &matrix);

  // What comes out of outputGeometry[index]; after a failed deform the geometry as it came in.
  const std::vector<MPoint> &evaluate(unsigned int index = 0);
  bool failed() const;                            // the last evaluate's deform
  int deform_calls() const;                       // so far
  std::vector<AttributeInfo> attributes() const;  // those that the plug-in added, children included

private:
  std::unique_ptr<Node> node_;
};

}  // namespace fake
