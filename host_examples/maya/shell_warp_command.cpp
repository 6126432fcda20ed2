#include "shell_warp_command.hpp"

#include "message.hpp"
#include "shell_warp_node.hpp"

#include <maya/MArgDatabase.h>
#include <maya/MDagPath.h>
#include <maya/MDistance.h>
#include <maya/MFnDagNode.h>
#include <maya/MFnDependencyNode.h>
#include <maya/MFnMesh.h>
#include <maya/MFnSingleIndexedComponent.h>
#include <maya/MIntArray.h>
#include <maya/MItDependencyGraph.h>
#include <maya/MItDependencyNodes.h>
#include <maya/MPlug.h>
#include <maya/MPoint.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <locale>
#include <sstream>
#include <vector>

namespace {

constexpr const char *kHandle = "-hd", *kCollider = "-co", *kStatus = "-st", *kWrite = "-wc", *kMemory = "-me", *kCertify = "-ce", *kPatches = "-cp", *kCrease = "-cr", *kAxes = "-sa", *kSymmetric = "-sy", *kTie = "-ti";

// A mesh of the selection, and which of its vertices and edges are selected.
struct Picked {
  MDagPath path;
  std::vector<int> vertices, edges;

  std::string name() const { return path.partialPathName().asChar(); }
};

enum class Wanted { vertices, edges };

void add_elements(const MObject &component, Wanted wanted, Picked &picked) {
  if (component.isNull()) return;
  const bool edges = wanted == Wanted::edges;
  if (!component.hasFn(edges ? MFn::kMeshEdgeComponent : MFn::kMeshVertComponent))
    throw host::HostError(edges ? "faces or vertices are selected; select edges" : "faces or edges are selected; select vertices, or meshes as a whole");
  MIntArray elements;
  MFnSingleIndexedComponent(component).getElements(elements);
  std::vector<int> &into = edges ? picked.edges : picked.vertices;
  for (unsigned int i = 0; i < elements.length(); ++i) into.push_back(elements[i]);
}

// From a transform to the shape that is seen: a deformed mesh has another beside it, as it was.
bool extend_to_mesh(MDagPath &path) {
  unsigned int shapes = 0;
  if (!path.hasFn(MFn::kTransform) || path.numberOfShapesDirectlyBelow(shapes) != MS::kSuccess) return path.hasFn(MFn::kMesh);
  for (unsigned int i = 0; i < shapes; ++i) {
    MDagPath shape = path;
    if (shape.extendToShapeDirectlyBelow(i) != MS::kSuccess || !shape.hasFn(MFn::kMesh)) continue;
    if (MFnDagNode(shape).isIntermediateObject()) continue;
    path = shape;
    return true;
  }
  return false;
}

// Each mesh once, in the order of the selection; what is no mesh is left out.
std::vector<Picked> picked_of(const MSelectionList &selected, Wanted wanted = Wanted::vertices) {
  std::vector<Picked> meshes;
  for (unsigned int i = 0; i < selected.length(); ++i) {
    MDagPath path;
    MObject component;
    if (selected.getDagPath(i, path, component) != MS::kSuccess) continue;
    if (!extend_to_mesh(path)) continue;
    auto known = std::find_if(meshes.begin(), meshes.end(), [&](const Picked &mesh) { return mesh.path == path; });
    if (known == meshes.end()) known = meshes.insert(meshes.end(), {path, {}, {}});
    add_elements(component, wanted, *known);
  }
  return meshes;
}

// The shellWarp nearest in a mesh's history; null where there is none.
MObject shell_of(const MDagPath &path) {
  MObject mesh = path.node();
  for (MItDependencyGraph it(mesh, MFn::kInvalid, MItDependencyGraph::kUpstream, MItDependencyGraph::kBreadthFirst);
       !it.isDone(); it.next()) {
    const MObject node = it.currentItem();
    if (MFnDependencyNode(node).typeId() == ShellWarpNode::nodeId) return node;
  }
  return MObject::kNullObj;
}

std::string name_of(const MObject &node) { return MFnDependencyNode(node).name().asChar(); }

// The first of NAME1, NAME2, ... that is free, at `number` or above, which then is the next.
std::string free_name(const std::string &name, unsigned int &number) {
  for (;;) {
    const std::string candidate = name + std::to_string(number++);
    MSelectionList found;
    if (found.add(candidate.c_str()) != MS::kSuccess) return candidate;
  }
}

unsigned int next_element(const MObject &node, const MObject &array) {
  MIntArray used;
  MPlug(node, array).getExistingArrayAttributeIndices(used);
  int next = 0;
  for (unsigned int i = 0; i < used.length(); ++i) next = std::max(next, used[i] + 1);
  return static_cast<unsigned int>(next);
}

std::string in_digits(double value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(15);
  text << value;
  return text.str();
}

// As MEL takes it: in the unit that the interface shows.
std::string words(const MPoint &point) {
  std::string text;
  for (const double x : {point.x, point.y, point.z}) text += " " + in_digits(MDistance::internalToUI(x));
  return text;
}

// As MEL takes a text.
std::string quoted(const std::string &text) {
  std::string out = "\"";
  for (const char c : text) out += (c == '"' || c == '\\' ? std::string("\\") : std::string()) + c;
  return out + "\"";
}

std::string element(const std::string &node, const char *array, unsigned int index) {
  return node + "." + array + "[" + std::to_string(index) + "]";
}

}  // namespace

void *ShellWarpCommand::creator() { return new ShellWarpCommand; }

MSyntax ShellWarpCommand::syntax_of() {
  MSyntax syntax;
  syntax.addFlag(kHandle, "-handle");
  syntax.addFlag(kCollider, "-collider");
  syntax.addFlag(kAxes, "-supportAxes", MSyntax::kString);
  syntax.addFlag(kSymmetric, "-symmetric");
  syntax.addFlag(kTie, "-tie");
  syntax.addFlag(kCrease, "-crease");
  syntax.addFlag(kPatches, "-contactPatches");
  syntax.addFlag(kStatus, "-status");
  syntax.addFlag(kMemory, "-memory");
  syntax.addFlag(kCertify, "-certify");
  syntax.addFlag(kWrite, "-writeCache", MSyntax::kString);
  syntax.setObjectType(MSyntax::kSelectionList, 0);
  syntax.useSelectionAsDefault(true);
  return syntax;
}

MStatus ShellWarpCommand::doIt(const MArgList &arguments) {
  MStatus status;
  const MArgDatabase given(syntax(), arguments, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MSelectionList selected;
  given.getObjects(selected);
  try {
    if (given.isFlagSet(kStatus)) {
      tell([](const ShellWarpNode &node) { return node.status(); });
      return MS::kSuccess;
    }
    if (given.isFlagSet(kMemory)) {
      tell([](const ShellWarpNode &node) { return host::number(std::round(static_cast<double>(node.bytes()) / 1e4) / 100) + " MB"; });
      return MS::kSuccess;
    }
    if (given.isFlagSet(kCertify)) {
      certify(selected);
      return MS::kSuccess;
    }
    changes_ = true;
    if (given.isFlagSet(kHandle))
      add_handles(selected);
    else if (given.isFlagSet(kCollider))
      add_colliders(selected);
    else if (given.isFlagSet(kAxes)) {
      MString axes;
      given.getFlagArgument(kAxes, 0, axes);
      hold_along(selected, axes.asChar(), given.isFlagSet(kSymmetric));
    } else if (given.isFlagSet(kTie))
      tie(selected);
    else if (given.isFlagSet(kCrease))
      add_creases(selected);
    else if (given.isFlagSet(kPatches))
      set_patches(selected);
    else if (given.isFlagSet(kWrite)) {
      MString file;
      given.getFlagArgument(kWrite, 0, file);
      write_cache(selected, file.asChar());
    } else
      create(selected);
  } catch (const std::exception &error) {
    displayError(MString("shellWarp: ") + error.what());
    return MS::kFailure;
  }
  return redoIt();
}

MStatus ShellWarpCommand::redoIt() { return modifier_.doIt(); }

MStatus ShellWarpCommand::undoIt() { return modifier_.undoIt(); }

void ShellWarpCommand::run(const std::string &mel) { modifier_.commandToExecute(mel.c_str()); }

void ShellWarpCommand::create(const MSelectionList &selected) {
  const std::vector<Picked> meshes = picked_of(selected);
  if (meshes.empty()) throw host::HostError("select polygon meshes, or the vertices of meshes that are to be held");
  unsigned int number = 1;
  for (const Picked &mesh : meshes) {
    const MObject known = shell_of(mesh.path);
    if (!known.isNull()) throw host::HostError(mesh.name() + " is a shell already, by " + name_of(known));
    const std::string node = free_name(ShellWarpNode::nodeName, number);
    run("deformer -type shellWarp -name " + node + " " + mesh.name());
    for (const int vertex : mesh.vertices)
      run("setAttr " + node + ".supportWeightList[0].supportWeights[" + std::to_string(vertex) + "] 1");
    appendToResult(node.c_str());
  }
}

// A locator where each vertex is now, so that nothing jumps.
void ShellWarpCommand::add_handles(const MSelectionList &selected) {
  bool any = false;
  for (const Picked &mesh : picked_of(selected)) {
    if (mesh.vertices.empty()) continue;
    const MObject shell = shell_of(mesh.path);
    if (shell.isNull()) throw host::HostError(mesh.name() + " is no shell yet: run shellWarp on it");
    const std::string node = name_of(shell);
    unsigned int index = next_element(shell, ShellWarpNode::handles), number = 1;
    const MFnMesh fn(mesh.path);
    for (const int vertex : mesh.vertices) {
      MPoint place;
      fn.getPoint(vertex, place, MSpace::kWorld);
      const std::string locator = free_name(node + "Handle", number), handle = element(node, "handles", index++);
      run("spaceLocator -name " + locator);
      run("xform -worldSpace -translation" + words(place) + " " + locator);
      run("setAttr " + handle + ".handleVertex " + std::to_string(vertex));
      run("connectAttr " + locator + ".worldMatrix[0] " + handle + ".handleTarget");
      appendToResult(locator.c_str());
      any = true;
    }
  }
  if (!any) throw host::HostError("select the vertices of a shell that handles are to lead");
}

// The shell is what has been selected last, as for Maya's own deformers that take a second object.
void ShellWarpCommand::add_colliders(const MSelectionList &selected) {
  const std::vector<Picked> meshes = picked_of(selected);
  if (meshes.size() < 2) throw host::HostError("select the meshes that are touched, and the shell last");
  const MObject shell = shell_of(meshes.back().path);
  if (shell.isNull()) throw host::HostError(meshes.back().name() + ", selected last, is no shell yet");
  const std::string node = name_of(shell);
  unsigned int index = next_element(shell, ShellWarpNode::colliders);
  for (std::size_t k = 0; k + 1 < meshes.size(); ++k) {
    const std::string collider = element(node, "colliders", index++);
    run("connectAttr " + meshes[k].name() + ".outMesh " + collider + ".colliderMesh");
    run("connectAttr " + meshes[k].name() + ".worldMatrix[0] " + collider + ".colliderMatrix");
    appendToResult(collider.c_str());
  }
}

// The selected vertices of each shell, along the axes of its object that the letters name.
void ShellWarpCommand::hold_along(const MSelectionList &selected, const std::string &axes, bool symmetric) {
  if (axes.empty() || axes.find_first_not_of("xyz") != std::string::npos)
    throw host::HostError("the axes are \"" + axes + "\"; they must be some of the letters xyz");
  bool any = false;
  for (const Picked &mesh : picked_of(selected)) {
    if (mesh.vertices.empty()) continue;
    const MObject shell = shell_of(mesh.path);
    if (shell.isNull()) throw host::HostError(mesh.name() + " is no shell yet: run shellWarp on it");
    const std::string held = element(name_of(shell), "supportAxes", next_element(shell, ShellWarpNode::supportAxes));
    set_list(held + ".supportAxesComponents", "vtx", mesh.vertices);
    for (const char axis : axes) run("setAttr " + held + ".supportAxis" + static_cast<char>(axis - 'x' + 'X') + " 1");
    if (symmetric) run("setAttr " + held + ".supportAxesSymmetric 1");
    appendToResult(held.c_str());
    any = true;
  }
  if (!any) throw host::HostError("select the vertices of a shell that are to be held along axes");
}

void ShellWarpCommand::tie(const MSelectionList &selected) {
  const std::vector<Picked> meshes = picked_of(selected);
  if (meshes.size() != 1 || meshes[0].vertices.size() != 2) throw host::HostError("select two vertices of a shell: the first is tied to the second");
  const MObject shell = shell_of(meshes[0].path);
  if (shell.isNull()) throw host::HostError(meshes[0].name() + " is no shell yet: run shellWarp on it");
  const std::string tied = element(name_of(shell), "ties", next_element(shell, ShellWarpNode::ties));
  run("setAttr " + tied + ".tieVertex " + std::to_string(meshes[0].vertices[0]));
  run("setAttr " + tied + ".tieTo " + std::to_string(meshes[0].vertices[1]));
  appendToResult(tied.c_str());
}

// The selected edges of each shell as one more.
void ShellWarpCommand::add_creases(const MSelectionList &selected) {
  bool any = false;
  for (const Picked &mesh : picked_of(selected, Wanted::edges)) {
    if (mesh.edges.empty()) continue;
    const MObject shell = shell_of(mesh.path);
    if (shell.isNull()) throw host::HostError(mesh.name() + " is no shell yet: run shellWarp on it");
    const std::string crease = element(name_of(shell), "creases", next_element(shell, ShellWarpNode::creases));
    set_list(crease + ".creaseEdges", "e", mesh.edges);
    appendToResult(crease.c_str());
    any = true;
  }
  if (!any) throw host::HostError("select the edges of a shell that fold");
}

// In the place of those that there were.
void ShellWarpCommand::set_patches(const MSelectionList &selected) {
  bool any = false;
  for (const Picked &mesh : picked_of(selected)) {
    if (mesh.vertices.empty()) continue;
    const MObject shell = shell_of(mesh.path);
    if (shell.isNull()) throw host::HostError(mesh.name() + " is no shell yet: run shellWarp on it");
    set_list(name_of(shell) + ".contactPatches", "vtx", mesh.vertices);
    appendToResult((name_of(shell) + ".contactPatches").c_str());
    any = true;
  }
  if (!any) throw host::HostError("select the vertices of a shell where it is to be touched by small things");
}

void ShellWarpCommand::set_list(const std::string &plug, const char *kind, const std::vector<int> &components) {
  std::string text = "setAttr -type \"componentList\" " + plug + " " + std::to_string(components.size());
  for (const int k : components) text += " \"" + std::string(kind) + "[" + std::to_string(k) + "]\"";
  run(text);
}

// Of the frame that each was shown at last: a sentence for each, after its node's name.
void ShellWarpCommand::certify(const MSelectionList &selected) {
  const std::vector<Picked> meshes = picked_of(selected);
  for (const Picked &mesh : meshes) {
    const MObject shell = shell_of(mesh.path);
    if (shell.isNull()) throw host::HostError(mesh.name() + " is no shell yet: run shellWarp on it");
    const auto *node = static_cast<const ShellWarpNode *>(MFnDependencyNode(shell).userNode());
    appendToResult((name_of(shell) + ": " + node->certificate()).c_str());
  }
  if (meshes.empty()) throw host::HostError("select the shells whose error is to be estimated");
}

// One file a shell: of several, the node's name stands before the ending.
void ShellWarpCommand::write_cache(const MSelectionList &selected, const std::string &file) {
  const std::vector<Picked> meshes = picked_of(selected);
  const std::size_t dot = file.find_last_of('.') != std::string::npos ? file.find_last_of('.') : file.size();
  for (const Picked &mesh : meshes) {
    const MObject shell = shell_of(mesh.path);
    if (shell.isNull()) throw host::HostError(mesh.name() + " is no shell yet: run shellWarp on it");
    const std::string node = name_of(shell);
    const std::string own = meshes.size() == 1 ? file : file.substr(0, dot) + "_" + node + file.substr(dot);
    static_cast<const ShellWarpNode *>(MFnDependencyNode(shell).userNode())->write_cache(own);
    run("setAttr -type \"string\" " + node + ".cache " + quoted(own));
    appendToResult(own.c_str());
  }
  if (meshes.empty()) throw host::HostError("select the shells whose frames are to be written");
}

// A line for each shell that has something to tell: the heads-up display shows what they have to say of themselves.
void ShellWarpCommand::tell(const std::function<std::string(const ShellWarpNode &)> &what) {
  std::string lines;
  for (MItDependencyNodes it(MFn::kPluginDeformerNode); !it.isDone(); it.next()) {
    const MFnDependencyNode fn(it.thisNode());
    if (!(fn.typeId() == ShellWarpNode::nodeId)) continue;
    const std::string text = what(*static_cast<const ShellWarpNode *>(fn.userNode()));
    if (!text.empty()) lines += (lines.empty() ? "" : "\n") + std::string(fn.name().asChar()) + ": " + text;
  }
  setResult(lines.c_str());
}
