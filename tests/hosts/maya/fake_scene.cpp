// The scene of the stand-in: names, selection, the commands of MEL that the plug-in runs, and undo.
#include "fake_object.hpp"

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

namespace fake {

struct Call {
  static std::unique_ptr<MPxCommand> start(const std::string &command, MArgList &arguments);
};

namespace {

struct Registered {
  MCreatorFunction create;
  MCreateSyntaxFunction syntax;
};
std::map<std::string, Registered> commands;
std::unique_ptr<Scene> only;

std::vector<std::string> words_of(const std::string &text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

std::string before(const std::string &text, char mark) { return text.substr(0, text.find(mark)); }
std::string after(const std::string &text, char mark) { return text.substr(text.find(mark) + 1); }

std::size_t place(const std::vector<std::string> &words, const std::string &word) {
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end()) throw std::runtime_error("no " + word);
  return static_cast<std::size_t>(found - words.begin());
}

MPoint times(const MPoint &p, const MMatrix &m) {
  const auto row = [&](unsigned int k) { return p.x * m(0, k) + p.y * m(1, k) + p.z * m(2, k) + m(3, k); };
  return MPoint(row(0), row(1), row(2));
}

}  // namespace

Scene &scene() {
  if (!only) new_scene();
  return *only;
}
void new_scene() { only = std::make_unique<Scene>(); }

void Scene::add_mesh(const std::string &name, const Mesh &mesh, const MMatrix &matrix) {
  dag[name].matrix = matrix;
  Dag &shape = dag[name + "Shape"];
  shape.parent = name;
  shape.mesh = true;
  shape.shape = mesh;
}

bool Scene::exists(const std::string &name) const {
  return name == "time1" || dag.count(name) > 0 || deformers.count(name) > 0;
}

// What a command's words name: "a.b[0].c" of the node a.
std::function<void()> Scene::mel(const std::string &command) {
  const std::vector<std::string> words = words_of(command);
  const std::string &last = words.back();
  if (words[0] == "deformer") {
    const std::string name = words.at(place(words, "-name") + 1);
    Dag &shape = dag.at(last);
    if (exists(name) || !shape.mesh) throw std::runtime_error("deformer: " + command);
    Deformer &made = *(deformers[name] = std::make_unique<Deformer>(words.at(place(words, "-type") + 1), name));
    made.connect(0, &shape.shape);
    made.set_world_matrix(0, dag.at(shape.parent).matrix);
    const std::string old = shape.deformer;
    shape.deformer = name;
    Dag original = shape;  // as Maya keeps it, before the shape that is seen
    original.intermediate = true;
    dag[last + "Orig"] = original;
    MDagModifier accessories;
    if (made.user().accessoryNodeSetup(accessories) != MS::kSuccess) throw std::runtime_error("accessories");
    accessories.doIt();
    return [this, last, name, old] {
      dag.at(last).deformer = old;
      dag.erase(last + "Orig");
      deformers.erase(name);
      for (auto it = connections.begin(); it != connections.end();)
        it = it->first.rfind(name + ".", 0) == 0 ? connections.erase(it) : std::next(it);
    };
  }
  if (words[0] == "setAttr" && words.at(1) == "-type" && words.at(2) == "\"componentList\"") {  // how many, and each in quotes
    const std::string node = before(words.at(3), '.'), plug = after(words[3], '.');
    std::vector<int> components;
    const bool edges = words.at(5).rfind("\"e[", 0) == 0;
    for (std::size_t k = 5; k < words.size(); ++k) components.push_back(std::atoi(after(words[k], '[').c_str()));
    if (std::strtoul(words.at(4).c_str(), nullptr, 10) != components.size()) throw std::runtime_error("setAttr: " + command);
    const std::function<void()> back = deformers.at(node)->remember(plug);
    deformers.at(node)->set_components(plug, components, edges);
    return [this, node, back] {
      if (deformers.count(node)) back();
    };
  }
  if (words[0] == "setAttr" && words.at(1) == "-type") {  // a text in quotes
    const std::string node = before(words.at(3), '.'), plug = after(words[3], '.');
    const std::function<void()> back = deformers.at(node)->remember(plug);
    deformers.at(node)->set_text(plug, last.substr(1, last.size() - 2));
    return [this, node, back] {
      if (deformers.count(node)) back();
    };
  }
  if (words[0] == "setAttr") {
    const std::string node = before(words.at(1), '.'), plug = after(words[1], '.');
    const std::function<void()> back = deformers.at(node)->remember(plug);
    deformers.at(node)->set(plug, std::strtod(last.c_str(), nullptr));
    return [this, node, back] {
      if (deformers.count(node)) back();
    };
  }
  if (words[0] == "connectAttr") {
    if (!exists(before(words.at(1), '.')) || connections.count(last)) throw std::runtime_error("connectAttr: " + command);
    const std::string node = before(last, '.'), plug = after(last, '.');
    const std::function<void()> back = deformers.at(node)->remember(plug);
    deformers.at(node)->elements(before(plug, '['));  // throws where there is no such attribute
    connections[last] = words[1];
    return [this, last, node, back] {
      connections.erase(last);
      if (deformers.count(node)) back();
    };
  }
  if (words[0] == "spaceLocator") {
    if (exists(last)) throw std::runtime_error("spaceLocator: " + command);
    dag[last];
    return [this, last] { dag.erase(last); };
  }
  if (words[0] == "xform") {
    const std::size_t at = place(words, "-translation");
    const MMatrix old = dag.at(last).matrix;
    for (std::size_t k = 0; k < 3; ++k)
      dag.at(last).matrix.matrix[3][k] = std::strtod(words.at(at + 1 + k).c_str(), nullptr) / units;
    return [this, last, old] {
      if (dag.count(last)) dag.at(last).matrix = old;
    };
  }
  throw std::runtime_error("no such command: " + command);
}

std::vector<MPoint> Scene::world_points(const std::string &shape) {
  Dag &mesh = dag.at(shape);
  std::vector<MPoint> points = mesh.shape.points;
  if (!mesh.deformer.empty() && !mesh.intermediate) {
    Deformer &by = *deformers.at(mesh.deformer);
    for (const auto &[to, from] : connections) {
      const std::string plug = after(to, '.'), source = before(from, '.');
      if (before(to, '.') != mesh.deformer) continue;
      if (from == "time1.outTime") by.set_time(frame, MTime::kFilm);
      if (after(from, '.') == "outMesh") by.set_mesh(plug, &dag.at(source).shape);
      if (after(from, '.') == "worldMatrix[0]")
        by.set(plug, dag.at(source).parent.empty() ? dag.at(source).matrix : dag.at(dag.at(source).parent).matrix);
    }
    points = by.evaluate(0);
  }
  for (MPoint &p : points) p = times(p, dag.at(mesh.parent).matrix);
  return points;
}

std::unique_ptr<MPxCommand> Call::start(const std::string &command, MArgList &arguments) {
  std::vector<std::string> words = words_of(command);
  const Registered &known = commands.at(words[0]);
  arguments.words_.assign(words.begin() + 1, words.end());
  std::unique_ptr<MPxCommand> made(static_cast<MPxCommand *>(known.create()));
  made->syntax_ = known.syntax();
  return made;
}

bool Scene::run(const std::string &command) {
  result.clear();
  MArgList arguments;
  std::unique_ptr<MPxCommand> made = Call::start(command, arguments);
  if (made->doIt(arguments) != MS::kSuccess) return false;
  if (made->isUndoable()) done_.push_back(std::move(made));
  return true;
}

void Scene::undo() {
  done_.back()->undoIt();
  undone_.push_back(std::move(done_.back()));
  done_.pop_back();
}

void Scene::redo() {
  undone_.back()->redoIt();
  done_.push_back(std::move(undone_.back()));
  undone_.pop_back();
}

namespace {

MObject node_of(const std::string &name) {
  if (scene().deformers.count(name)) return scene().deformers.at(name)->user().thisMObject();
  const MFn::Type kind = name == "time1"                                                    ? MFn::kTime
                         : scene().dag.count(name) && scene().dag.at(name).mesh ? MFn::kMesh
                                                                                            : MFn::kTransform;
  return Object::wrap(std::make_shared<NodeObject>(kind, name));
}

const std::string &name_of(const MObject &node) { return Object::get<NodeObject>(node)->name; }

}  // namespace

}  // namespace fake

using fake::scene;

// ---------------------------------------------------------------------------------------------------------------- names

bool MDagPath::hasFn(MFn::Type type, MStatus *) const { return fake::node_of(name_).hasFn(type); }
MObject MDagPath::node(MStatus *) const { return fake::node_of(name_); }

static std::vector<std::string> shapes_below(const std::string &transform) {
  std::vector<std::string> shapes;
  for (const auto &[name, dag] : scene().dag)
    if (dag.parent == transform) shapes.push_back(name);
  std::sort(shapes.rbegin(), shapes.rend());  // "planeShapeOrig" first
  return shapes;
}
MStatus MDagPath::numberOfShapesDirectlyBelow(unsigned int &count) const {
  count = static_cast<unsigned int>(shapes_below(name_).size());
  return MS::kSuccess;
}
MStatus MDagPath::extendToShapeDirectlyBelow(unsigned int index) {
  name_ = shapes_below(name_).at(index);
  return MS::kSuccess;
}
bool MFnDagNode::isIntermediateObject(MStatus *) const { return scene().dag.at(name_).intermediate; }

// A name, or components of one: "planeShape.vtx[4]".
MStatus MSelectionList::add(const MString &text, const bool) {
  const std::string word = text.asChar(), node = fake::before(word, '.');
  if (!scene().exists(node)) return MS::kInvalidParameter;
  Item item{node, {}, {}};
  if (node != word) {
    const std::string part = fake::after(word, '.');
    (part[0] == 'v' ? item.vertices : item.edges).push_back(std::atoi(fake::after(part, '[').c_str()));
  }
  items_.push_back(item);
  return MS::kSuccess;
}
MStatus MSelectionList::getDependNode(unsigned int index, MObject &node) const {
  node = fake::node_of(items_.at(index).node);
  return MS::kSuccess;
}
MStatus MSelectionList::getDagPath(unsigned int index, MDagPath &path) const {
  if (!scene().dag.count(items_.at(index).node)) return MS::kInvalidParameter;
  path.name_ = items_.at(index).node;
  return MS::kSuccess;
}
MStatus MSelectionList::getDagPath(unsigned int index, MDagPath &path, MObject &component) const {
  const Item &item = items_.at(index);
  component = !item.vertices.empty() ? fake::component_of(MFn::kMeshVertComponent, item.vertices)
              : !item.edges.empty()  ? fake::component_of(MFn::kMeshEdgeComponent, item.edges)
                                     : MObject::kNullObj;
  return getDagPath(index, path);
}

MString MFnDependencyNode::name(MStatus *) const { return fake::name_of(object_).c_str(); }
MTypeId MFnDependencyNode::typeId(MStatus *) const {
  const auto found = scene().deformers.find(fake::name_of(object_));
  return MTypeId(found == scene().deformers.end() ? 0 : found->second->type_id());
}
MPxNode *MFnDependencyNode::userNode(MStatus *) const { return &scene().deformers.at(fake::name_of(object_))->user(); }
MObject MFnDependencyNode::attribute(const MString &name, MStatus *) const {
  return fake::Object::wrap(std::make_shared<fake::NodeObject>(MFn::kAttribute, name.asChar()));
}

unsigned int MPlug::getExistingArrayAttributeIndices(MIntArray &indices, MStatus *) {
  const std::string node = fake::name_of(node_), array = fake::attribute_name(attribute_);
  indices.clear();
  for (const unsigned int index : scene().deformers.at(node)->elements(array)) indices.append(static_cast<int>(index));
  // What is connected has an element too.
  for (const auto &[to, from] : scene().connections) {
    const std::string start = node + "." + array + "[";
    if (to.rfind(start, 0) == 0) indices.append(std::atoi(to.c_str() + start.size()));
  }
  return indices.length();
}

// From a mesh to what deforms it, and on to the meshes that are connected to that.
MItDependencyGraph::MItDependencyGraph(MObject &root, MFn::Type, Direction, Traversal, Level, MStatus *) {
  std::vector<std::string> queue{fake::name_of(root)};
  for (std::size_t k = 0; k < queue.size(); ++k) {
    const std::string name = queue[k];
    nodes_.push_back(fake::node_of(name));
    if (scene().dag.count(name) && !scene().dag.at(name).deformer.empty()) queue.push_back(scene().dag.at(name).deformer);
    for (const auto &[to, from] : scene().connections)
      if (fake::before(to, '.') == name) queue.push_back(fake::before(from, '.'));
  }
}
MStatus MItDependencyGraph::next() {
  ++at_;
  return MS::kSuccess;
}

MItDependencyNodes::MItDependencyNodes(MFn::Type, MStatus *) {
  for (const auto &[name, deformer] : scene().deformers) nodes_.push_back(fake::node_of(name));
}
MStatus MItDependencyNodes::next() {
  ++at_;
  return MS::kSuccess;
}

static std::string shape_name(const MDagPath &path) { return path.partialPathName().asChar(); }
MFnMesh::MFnMesh(const MDagPath &path, MStatus *) : shape_(shape_name(path)) {}
MStatus MFnMesh::getPoint(int vertex, MPoint &point, MSpace::Space space) const {
  if (space != MSpace::kWorld) return MS::kInvalidParameter;
  point = scene().world_points(shape_).at(static_cast<std::size_t>(vertex));
  return MS::kSuccess;
}

// ------------------------------------------------------------------------------------------------------------- modifier

MDGModifier::~MDGModifier() = default;
MStatus MDGModifier::connect(const MObject &source, const MObject &from, const MObject &target, const MObject &to) {
  return commandToExecute(("connectAttr " + fake::name_of(source) + "." + fake::attribute_name(from) + " " +
                           fake::name_of(target) + "." + fake::attribute_name(to))
                              .c_str());
}
MStatus MDGModifier::commandToExecute(const MString &command) {
  commands_.push_back(command.asChar());
  return MS::kSuccess;
}
MStatus MDGModifier::doIt() {
  inverses_.clear();
  try {
    for (const std::string &command : commands_) inverses_.push_back(scene().mel(command));
  } catch (const std::exception &error) {
    fake::session().errors.push_back(error.what());
    return MS::kFailure;
  }
  return MS::kSuccess;
}
MStatus MDGModifier::undoIt() {
  for (auto it = inverses_.rbegin(); it != inverses_.rend(); ++it) (*it)();
  return MS::kSuccess;
}

// ------------------------------------------------------------------------------------------------------------- commands

MStatus MSyntax::addFlag(const char *short_name, const char *long_name, MArgType type) {
  flags_[long_name] = short_name;
  if (type == kString) with_text_.insert(short_name);
  return MS::kSuccess;
}
void MSyntax::setObjectType(MObjectFormat format, unsigned int) { objects_ = format == kSelectionList; }
void MSyntax::useSelectionAsDefault(bool use) { selection_ = use; }

MArgDatabase::MArgDatabase(const MSyntax &syntax, const MArgList &arguments, MStatus *status) {
  bool named = false, good = true;
  std::string awaits;  // the flag whose text comes next
  for (const std::string &word : arguments.words_) {
    if (!awaits.empty()) {
      texts_[awaits] = word;
      awaits.clear();
      continue;
    }
    if (word[0] != '-') {
      named = true;
      good = good && syntax.objects_ && objects_.add(word.c_str()) == MS::kSuccess;
      continue;
    }
    const auto found = std::find_if(syntax.flags_.begin(), syntax.flags_.end(),
                                    [&](const auto &flag) { return flag.first == word || flag.second == word; });
    good = good && found != syntax.flags_.end();
    if (good) flags_.push_back(found->second);
    if (good && syntax.with_text_.count(found->second)) awaits = found->second;
  }
  if (!named && syntax.selection_)
    for (const std::string &name : scene().selection) objects_.add(name.c_str());
  if (status) *status = good && awaits.empty() ? MS::kSuccess : MS::kFailure;
}
MStatus MArgDatabase::getFlagArgument(const char *flag, unsigned int, MString &result) const {
  const auto found = texts_.find(flag);
  if (found == texts_.end()) return MS::kFailure;
  result = found->second.c_str();
  return MS::kSuccess;
}
bool MArgDatabase::isFlagSet(const char *flag, MStatus *) const {
  return std::find(flags_.begin(), flags_.end(), flag) != flags_.end();
}
MStatus MArgDatabase::getObjects(MSelectionList &result) const {
  result = objects_;
  return MS::kSuccess;
}

MPxCommand::MPxCommand() = default;
MPxCommand::~MPxCommand() = default;
MStatus MPxCommand::doIt(const MArgList &) { return MS::kFailure; }
MStatus MPxCommand::undoIt() { return MS::kFailure; }
MStatus MPxCommand::redoIt() { return MS::kFailure; }
bool MPxCommand::isUndoable() const { return false; }
bool MPxCommand::hasSyntax() const { return false; }
void MPxCommand::displayError(const MString &text, bool) { fake::session().errors.push_back(text.asChar()); }
void MPxCommand::setResult(const char *text) { scene().result = text; }
void MPxCommand::appendToResult(const char *text) {
  scene().result += (scene().result.empty() ? "" : " ") + std::string(text);
}

MStatus MFnPlugin::registerCommand(const MString &name, MCreatorFunction create, MCreateSyntaxFunction syntax) {
  return fake::commands.emplace(name.asChar(), fake::Registered{create, syntax}).second ? MS::kSuccess : MS::kFailure;
}
MStatus MFnPlugin::deregisterCommand(const MString &name) {
  fake::new_scene();  // what is left of the plug-in's nodes goes before its code
  return fake::commands.erase(name.asChar()) ? MS::kSuccess : MS::kFailure;
}
MStatus MFnPlugin::registerUI(const MString &creation, const MString &deletion, const MString &, const MString &) {
  fake::session().create_ui = creation.asChar();
  fake::session().delete_ui = deletion.asChar();
  return MS::kSuccess;
}
