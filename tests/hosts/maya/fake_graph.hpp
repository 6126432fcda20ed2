// A dependency graph as small as can be: plug-ins are loaded as Maya loads them, nodes made, attributes set by name, meshes
// wired in and outputs asked for. An output is computed only when something that was declared to affect it has changed.
#pragma once

#include "fake_maya.hpp"

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace fake {

// Everything that Maya would show or was told.
struct Session {
  std::vector<std::string> errors, warnings, commands;
  int interrupt_polls = 0, computations_open = 0;
  bool bar = false;                                              // whether the last computation had one,
  std::vector<std::pair<std::string, std::vector<int>>> progress;  // its texts, and how far it went under each
  int interrupt_at = 0;  // the poll at which the user presses Esc; 0 = never
  std::vector<std::string> off_thread;  // what Maya takes on its main thread alone, and was asked elsewhere
  std::string create_ui, delete_ui;  // the procedures of the plug-in's menu
};
Session &session();

struct Mesh {
  std::vector<MPoint> points;
  std::vector<int> counts, corners;
  std::string uv_set;                // the one there is; its coordinates, of each corner one
  std::vector<float> us, vs;
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
  explicit Deformer(const std::string &type_name, const std::string &name = "");
  ~Deformer();
  Deformer(const Deformer &) = delete;
  Deformer &operator=(const Deformer &) = delete;

  // "frequency", "gravityY", "handles[2].handleVertex", "supportWeightList[0].supportWeights[7]". Throws where there is no such
  // attribute, or the value is below its minimum or above its maximum.
  void set(const std::string &plug, double value);
  void set(const std::string &plug, const MMatrix &value);
  void set_time(double value, MTime::Unit unit);
  void set_text(const std::string &plug, const std::string &text);
  std::string get_text(const std::string &plug);
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
  MPxDeformerNode &user();
  unsigned int type_id() const;
  std::vector<unsigned int> elements(const std::string &array) const;  // that there are
  double get(const std::string &plug);
  std::function<void()> remember(const std::string &plug);  // what puts the plug's attribute back
  std::vector<AttributeInfo> attributes() const;  // those that the plug-in added, children included

private:
  std::unique_ptr<Node> node_;
};

// A scene of transforms, meshes, locators and deformers by name, and the few commands of MEL that the plug-in runs in it. Each
// can be undone. What is connected is carried over when a mesh is asked for.
struct Scene {
  struct Dag {
    std::string parent;  // of a shape: its transform
    bool mesh = false, intermediate = false;
    Mesh shape;
    MMatrix matrix;         // of a transform, in the world
    std::string deformer;   // of a mesh: what makes it
  };
  std::map<std::string, Dag> dag;
  std::map<std::string, std::unique_ptr<Deformer>> deformers;
  std::map<std::string, std::string> connections;  // from each input to its source
  std::vector<std::string> selection;              // "plane", "planeShape.vtx[4]", "planeShape.e[2]"
  std::string result;
  double units = 1;  // the interface's lengths in a centimetre
  double frame = 1;  // of time1

  void add_mesh(const std::string &name, const Mesh &mesh, const MMatrix &matrix = MMatrix());
  bool exists(const std::string &name) const;
  bool run(const std::string &command);  // a command of the plug-in; false: it failed
  void undo();
  void redo();
  std::vector<MPoint> world_points(const std::string &shape);
  std::function<void()> mel(const std::string &command);  // returns what undoes it; throws what Maya would complain of

private:
  std::vector<std::unique_ptr<MPxCommand>> done_, undone_;
};
Scene &scene();  // the one there is
void new_scene();

}  // namespace fake
