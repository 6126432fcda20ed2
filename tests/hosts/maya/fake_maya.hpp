// A stand-in for the part of Maya's C++ API that the shellWarp plug-in uses, to run the node where there is no Maya.
//
// Declarations follow the API's own headers as published with public plug-ins' sources: those of Maya 2016 and 2018 for most
// classes here, those of 2020 to 2024 for parts of MPxDeformerNode, MPxGeometryFilter, MDataBlock, MComputation, MFnPlugin and the
// arrays; read declaration by declaration, not compiled against. A few, MFnMesh::getVertices among them, are known only from how
// public plug-ins call them. What is known to differ between the versions is not used. Only what the plug-in
// uses is declared, with the same names, parameters, constness and defaults; everything below "private:" and in namespace
// fake is ours. The macro that returns a failed status evaluates its argument twice, as Maya's does.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <iostream>
#include <map>
#include <set>
#include <memory>
#include <string>
#include <vector>

typedef double double3[3];
typedef int int2[2];
class MArrayDataHandle;
class MDataBlock;
class MObject;
class MPxNode;

namespace fake {
struct Object;
struct Attribute;
struct Node;
struct Value;
struct Type;
struct Call;
}  // namespace fake



// ------------------------------------------------------------------------------------------------------- plain values

class MStatus {
public:
  enum MStatusCode {
    kSuccess = 0,
    kFailure,
    kInsufficientMemory,
    kInvalidParameter,
    kLicenseFailure,
    kUnknownParameter
  };
  MStatus() = default;
  MStatus(MStatusCode code) : code_(code) {}
  bool operator==(const MStatus &rhs) const { return code_ == rhs.code_; }
  bool operator==(const MStatusCode rhs) const { return code_ == rhs; }
  bool operator!=(const MStatus &rhs) const { return code_ != rhs.code_; }
  bool operator!=(const MStatusCode rhs) const { return code_ != rhs; }

private:
  MStatusCode code_ = kSuccess;
};
inline bool operator!=(const MStatus::MStatusCode code, const MStatus &status) { return status != code; }
typedef MStatus MS;

#define CHECK_MSTATUS_AND_RETURN(_status, _retVal)                                                 \
  {                                                                                                \
    MStatus _maya_status = (_status);                                                              \
    if (MStatus::kSuccess != _maya_status) {                                                       \
      std::cerr << "\nAPI error detected in " << __FILE__ << " at line " << __LINE__ << std::endl; \
      return (_retVal);                                                                            \
    }                                                                                              \
  }
#define CHECK_MSTATUS_AND_RETURN_IT(_status) CHECK_MSTATUS_AND_RETURN((_status), (_status))

class MString {
public:
  MString() = default;
  MString(const char *charString) : text_(charString) {}
  MString operator+(const MString &other) const { return (text_ + other.text_).c_str(); }
  MString operator+(const char *other) const { return (text_ + other).c_str(); }
  const char *asChar() const { return text_.c_str(); }
  int length() const { return static_cast<int>(text_.size()); }

private:
  std::string text_;
};

class MTypeId {
public:
  MTypeId(unsigned int id) : id_(id) {}
  bool operator==(const MTypeId &other) const { return id_ == other.id_; }
  unsigned int id() const { return id_; }

private:
  unsigned int id_;
};

class MTime {
public:
  enum Unit { kInvalid, kHours, kMinutes, kSeconds, kMilliseconds, kGames, kFilm, kPALFrame, kNTSCFrame };
  MTime() = default;
  MTime(double time, Unit unit = kFilm);
  double as(Unit unit) const;
  bool operator<(const MTime &other) const { return seconds_ < other.seconds_; }
  static Unit uiUnit();
  static MStatus setUIUnit(Unit unit);

private:
  double seconds_ = 0;
};

// Of the stand-in: one closed interval, or none.
class MTimeRange {
public:
  MTimeRange() = default;
  MTimeRange(MTime start, MTime end) noexcept : start_(start), end_(end), empty_(end < start) {}
  bool contains(MTime time) const noexcept { return !empty_ && !(time < start_) && !(end_ < time); }
  bool empty() const noexcept { return empty_; }
  MTimeRange operator|(const MTimeRange &rhs) const {
    if (empty_ || rhs.empty_) return empty_ ? rhs : *this;
    return MTimeRange(rhs.start_ < start_ ? rhs.start_ : start_, end_ < rhs.end_ ? rhs.end_ : end_);
  }

private:
  MTime start_, end_;
  bool empty_ = true;
};

class MEvaluationNode {};
class MNodeCacheDisablingInfo {};
class MObjectArray {};
class MNodeCacheSetupInfo {
public:
  enum RequirementFlag { kSimulationSupport, kLastRequirement };
  void setRequirement(RequirementFlag flag, bool value) { requirements_[flag] = value; }
  bool getRequirement(RequirementFlag flag) const { return requirements_[flag]; }

private:
  bool requirements_[kLastRequirement] = {};
};

class MPoint {
public:
  MPoint() = default;
  MPoint(double xx, double yy, double zz = 0.0, double ww = 1.0) : x(xx), y(yy), z(zz), w(ww) {}
  double x = 0, y = 0, z = 0, w = 1;
};

template <class T>
class FakeArray {
public:
  unsigned int length() const { return static_cast<unsigned int>(items_.size()); }
  const T &operator[](unsigned int index) const { return items_.at(index); }
  T &operator[](unsigned int index) { return items_.at(index); }
  MStatus setLength(unsigned int length) {
    items_.resize(length);
    return MS::kSuccess;
  }
  MStatus append(const T &element) {
    items_.push_back(element);
    return MS::kSuccess;
  }
  MStatus clear() { return setLength(0); }

private:
  std::vector<T> items_;
};
class MPointArray : public FakeArray<MPoint> {};
class MIntArray : public FakeArray<int> {};
class MFloatArray : public FakeArray<float> {};

class MDistance {
public:
  static double internalToUI(double internalValue);
};

class MMatrix {
public:
  MMatrix();
  MMatrix(const double m[4][4]);
  double operator()(unsigned int row, unsigned int col) const { return matrix[row][col]; }
  double matrix[4][4];
};

class MSpace {
public:
  enum Space { kInvalid, kTransform, kPreTransform, kPostTransform, kWorld, kObject = kPreTransform };
};

// ------------------------------------------------------------------------------------------------------------- objects

class MFn {
public:
  enum Type {
    kInvalid = 0,
    kMesh,
    kMeshData,
    kComponentListData,
    kMeshVertComponent,
    kMeshEdgeComponent,
    kAttribute,
    kPlugin,
    kTransform,
    kTime,
    kPluginDeformerNode
  };
};

class MObject {
public:
  bool isNull() const { return !object_; }
  bool hasFn(MFn::Type fs) const;
  bool operator==(const MObject &other) const { return object_ == other.object_; }
  static MObject kNullObj;

private:
  friend struct fake::Object;
  friend struct fake::Node;
  std::shared_ptr<fake::Object> object_;
};

class MFnBase {
public:
  virtual ~MFnBase();
};

class MFnNumericData {
public:
  enum Type {
    kInvalid,
    kBoolean,
    kByte,
    kChar,
    kShort,
    k2Short,
    k3Short,
    kLong,
    kInt = kLong,
    kFloat,
    kDouble,
    k3Double
  };
};

class MFnData {
public:
  enum Type { kInvalid = 0, kNumeric, kPlugin, kString, kMesh, kComponentList };
};

class MDagPath {
public:
  bool operator==(const MDagPath &src) const { return name_ == src.name_; }
  bool hasFn(MFn::Type type, MStatus *ReturnStatus = NULL) const;
  MObject node(MStatus *ReturnStatus = NULL) const;
  MString partialPathName(MStatus * = NULL) const { return name_.c_str(); }
  MStatus numberOfShapesDirectlyBelow(unsigned int &numShapes) const;
  MStatus extendToShapeDirectlyBelow(unsigned int index);

private:
  friend class MSelectionList;
  friend class MFnMesh;
  friend class MFnDagNode;
  std::string name_;
};

class MSelectionList {
public:
  unsigned int length(MStatus * = NULL) const { return static_cast<unsigned int>(items_.size()); }
  MStatus add(const MString &matchString, const bool searchChildNamespacesToo = false);
  MStatus getDependNode(unsigned int index, MObject &depNode) const;
  MStatus getDagPath(unsigned int index, MDagPath &dagPath) const;
  MStatus getDagPath(unsigned int index, MDagPath &dagPath, MObject &component) const;

private:
  struct Item {
    std::string node;
    std::vector<int> vertices, edges;
  };
  std::vector<Item> items_;
};

class MFnDependencyNode : public MFnBase {
public:
  MFnDependencyNode(const MObject &object, MStatus *ReturnStatus = NULL) : object_(object) { (void)ReturnStatus; }
  MString name(MStatus *ReturnStatus = NULL) const;
  MTypeId typeId(MStatus *ReturnStatus = NULL) const;
  MPxNode *userNode(MStatus *ReturnStatus = NULL) const;
  MObject attribute(const MString &attrName, MStatus *ReturnStatus = NULL) const;

private:
  MObject object_;
};

class MFnDagNode : public MFnBase {
public:
  MFnDagNode(const MDagPath &objectPath, MStatus *ReturnStatus = NULL) : name_(objectPath.name_) { (void)ReturnStatus; }
  bool isIntermediateObject(MStatus *ReturnStatus = NULL) const;

private:
  std::string name_;
};

class MPlug {
public:
  MPlug(const MObject &node, const MObject &attribute, MStatus *ReturnStatus = NULL) : node_(node), attribute_(attribute) {
    (void)ReturnStatus;
  }
  unsigned int getExistingArrayAttributeIndices(MIntArray &indices, MStatus *ReturnStatus = NULL);

private:
  MObject node_, attribute_;
};

class MItDependencyGraph {
public:
  enum Direction { kDownstream, kUpstream };
  enum Traversal { kDepthFirst, kBreadthFirst };
  enum Level { kNodeLevel, kPlugLevel };
  MItDependencyGraph(MObject &rootNode, MFn::Type filter = MFn::kInvalid, Direction direction = kDownstream,
                     Traversal traversal = kDepthFirst, Level level = kNodeLevel, MStatus *ReturnStatus = NULL);
  bool isDone(MStatus * = NULL) { return at_ == nodes_.size(); }
  MStatus next();
  MObject currentItem(MStatus * = NULL) { return nodes_.at(at_); }

private:
  std::vector<MObject> nodes_;
  std::size_t at_ = 0;
};

class MItDependencyNodes {
public:
  MItDependencyNodes(MFn::Type filter = MFn::kInvalid, MStatus *ReturnStatus = NULL);
  bool isDone(MStatus * = NULL) const { return at_ == nodes_.size(); }
  MStatus next();
  MObject thisNode(MStatus * = NULL) const { return nodes_.at(at_); }

private:
  std::vector<MObject> nodes_;
  std::size_t at_ = 0;
};

class MDGModifier {
public:
  virtual ~MDGModifier();
  MStatus connect(const MObject &sourceNode, const MObject &sourceAttr, const MObject &destNode, const MObject &destAttr);
  MStatus commandToExecute(const MString &command);
  MStatus doIt();
  MStatus undoIt();

private:
  std::vector<std::string> commands_;
  std::vector<std::function<void()>> inverses_;
};
class MDagModifier : public MDGModifier {};

class MFnMesh : public MFnBase {
public:
  MFnMesh(const MObject &object, MStatus *ReturnStatus = NULL);
  MFnMesh(const MDagPath &object, MStatus *ReturnStatus = NULL);
  MStatus getPoint(int vertexId, MPoint &pos, MSpace::Space space = MSpace::kObject) const;
  MStatus getPoints(MPointArray &vertexArray, MSpace::Space space = MSpace::kObject) const;
  MStatus getVertices(MIntArray &vertexCount, MIntArray &vertexList) const;
  MStatus getEdgeVertices(int edgeId, int2 &vertexList) const;
  MStatus getUVs(MFloatArray &uArray, MFloatArray &vArray, const MString *uvSet = NULL) const;
  MStatus getAssignedUVs(MIntArray &uvCounts, MIntArray &uvIds, const MString *uvSet = NULL) const;

private:
  MObject object_;
  std::string shape_;
};

class MFnComponentListData : public MFnBase {
public:
  MFnComponentListData(const MObject &object, MStatus *ReturnStatus = NULL);
  unsigned int length(MStatus *ReturnStatus = NULL) const;
  MObject operator[](unsigned int index) const;

private:
  MObject object_;
};

class MFnSingleIndexedComponent : public MFnBase {
public:
  MFnSingleIndexedComponent(const MObject &object, MStatus *ReturnStatus = NULL);
  MStatus getElements(MIntArray &elements) const;

private:
  MObject object_;
};

// ---------------------------------------------------------------------------------------------------------- attributes

class MFnAttribute : public MFnBase {
public:
  MFnAttribute() = default;
  MFnAttribute(const MObject &object, MStatus *ReturnStatus = NULL);
  MStatus setKeyable(bool state);
  MStatus setChannelBox(bool state);
  MStatus setArray(bool state);
  MStatus setUsesArrayDataBuilder(bool state);

protected:
  fake::Attribute &start(const MString &fullName, const MString &briefName, MStatus *status);
  fake::Attribute &made() const;
  MObject object_;
};

class MFnNumericAttribute : public MFnAttribute {
public:
  using MFnAttribute::MFnAttribute;
  MObject create(const MString &fullName, const MString &briefName, MFnNumericData::Type unitType,
                 double defaultValue = 0, MStatus *ReturnStatus = NULL);
  MObject create(const MString &fullName, const MString &briefName, const MObject &child1, const MObject &child2,
                 const MObject &child3 = MObject::kNullObj, MStatus *ReturnStatus = NULL);
  MStatus setMin(double minValue);
  MStatus setMax(double maxValue);
  MStatus setSoftMax(double maxValue);
};

class MFnUnitAttribute : public MFnAttribute {
public:
  enum Type { kInvalid, kAngle, kDistance, kTime, kLast };
  MObject create(const MString &fullName, const MString &briefName, MFnUnitAttribute::Type unitType,
                 double defaultValue = 0.0, MStatus *ReturnStatus = NULL);
};

class MFnEnumAttribute : public MFnAttribute {
public:
  MObject create(const MString &fullName, const MString &briefName, short defaultValue = 0,
                 MStatus *ReturnStatus = NULL);
  MStatus addField(const MString &fieldString, short index);
};

class MFnMatrixAttribute : public MFnAttribute {
public:
  enum Type { kFloat, kDouble };
  MObject create(const MString &fullName, const MString &briefName, Type matrixType = kDouble,
                 MStatus *ReturnStatus = NULL);
};

class MFnTypedAttribute : public MFnAttribute {
public:
  MObject create(const MString &fullName, const MString &briefName, MFnData::Type type,
                 MObject defaultData = MObject::kNullObj, MStatus *ReturnStatus = NULL);
  MStatus setUsedAsFilename(bool state);
};

class MFnCompoundAttribute : public MFnAttribute {
public:
  MObject create(const MString &full, const MString &brief, MStatus *ReturnStatus = NULL);
  MStatus addChild(const MObject &child);
};

// ---------------------------------------------------------------------------------------------------------------- data

class MDataHandle {
public:
  MDataHandle() = default;
  MObject data();
  bool &asBool() const;
  short &asShort() const;
  int &asInt() const;
  float &asFloat() const;
  double &asDouble() const;
  MTime asTime() const;
  double3 &asDouble3() const;
  MMatrix &asMatrix() const;
  MObject asMesh() const;
  MString &asString() const;
  MDataHandle child(const MObject &attribute);

private:
  friend class MArrayDataHandle;
  friend class MDataBlock;
  explicit MDataHandle(fake::Value *value) : value_(value) {}
  fake::Value *value_ = nullptr;
};

class MArrayDataHandle {
public:
  MArrayDataHandle(const MDataHandle &in, MStatus *ReturnStatus = NULL);
  MDataHandle inputValue(MStatus *ReturnStatus = NULL);
  MDataHandle outputValue(MStatus *ReturnStatus = NULL);
  MStatus next();
  unsigned int elementCount(MStatus *ReturnStatus = NULL);
  unsigned int elementIndex(MStatus *ReturnStatus = NULL);
  MStatus jumpToElement(unsigned int index);

private:
  fake::Value *value_;
  std::map<unsigned int, fake::Value>::iterator at_;
};

class MDataBlock {
public:
  virtual ~MDataBlock();
  MDataHandle inputValue(const MObject &attribute, MStatus *ReturnStatus = NULL);
  MArrayDataHandle inputArrayValue(const MObject &attribute, MStatus *ReturnStatus = NULL);
  MArrayDataHandle outputArrayValue(const MObject &attribute, MStatus *ReturnStatus = NULL);

private:
  friend struct fake::Node;
  explicit MDataBlock(fake::Node &node) : node_(node) {}
  fake::Node &node_;
};

class MItGeometry {
public:
  virtual ~MItGeometry();
  bool isDone(MStatus *ReturnStatus = NULL) const;
  MStatus next();
  int index(MStatus *ReturnStatus = NULL) const;
  int count(MStatus *ReturnStatus = NULL) const;
  MStatus allPositions(MPointArray &points, MSpace::Space space = MSpace::kObject) const;
  MStatus setAllPositions(const MPointArray &points, MSpace::Space space = MSpace::kObject);

private:
  friend struct fake::Node;
  MItGeometry(std::vector<MPoint> &points, std::vector<int> members) : points_(points), members_(std::move(members)) {}
  std::vector<MPoint> &points_;
  std::vector<int> members_;
  std::size_t at_ = 0;
};

// --------------------------------------------------------------------------------------------------------------- nodes

class MPxNode {
public:
  enum Type { kDependNode, kLocatorNode, kDeformerNode };
  enum SchedulingType { kParallel, kSerial, kGloballySerial, kUntrusted, kDefaultScheduling = kSerial };
  MPxNode();
  virtual ~MPxNode();
  virtual SchedulingType schedulingType() const { return kDefaultScheduling; }
  virtual void getCacheSetup(const MEvaluationNode &, MNodeCacheDisablingInfo &, MNodeCacheSetupInfo &, MObjectArray &) const {}
  virtual MTimeRange transformInvalidationRange(const MPlug &source, const MTimeRange &input) const;
  MString name() const;
  MObject thisMObject() const { return self_; }
  static MStatus addAttribute(const MObject &attr);
  static MStatus attributeAffects(const MObject &whenChanges, const MObject &isAffected);

private:
  friend struct fake::Node;
  std::string name_;
  MObject self_;
};

// In Maya since 2018 these members come with MPxGeometryFilter; a plug-in sees no difference.
class MPxDeformerNode : public MPxNode {
public:
  MPxDeformerNode();
  virtual ~MPxDeformerNode();
  virtual MStatus deform(MDataBlock &block, MItGeometry &iter, const MMatrix &mat, unsigned int multiIndex);
  virtual MStatus accessoryNodeSetup(MDagModifier &cmd);
  float weightValue(MDataBlock &mblock, unsigned int multiIndex, unsigned int wtIndex);

  static MObject input;
  static MObject inputGeom;
  static MObject outputGeom;
  static MObject weightList;
  static MObject weights;
  static MObject envelope;
};

typedef void *(*MCreatorFunction)();
typedef MStatus (*MInitializeFunction)();

// ------------------------------------------------------------------------------------------------------------ commands

class MSyntax {
public:
  enum MArgType { kInvalidArgType, kNoArg, kBoolean, kLong, kDouble, kString };
  enum MObjectFormat { kInvalidObjectFormat, kNone, kStringObjects, kSelectionList };
  MStatus addFlag(const char *shortName, const char *longName, MArgType argType1 = kNoArg);
  void setObjectType(MObjectFormat objectFormat, unsigned int minimumObjects = 0);
  void useSelectionAsDefault(bool useSelectionAsDefault);

private:
  friend class MArgDatabase;
  std::map<std::string, std::string> flags_;  // by the long name
  std::set<std::string> with_text_;           // by the short name
  bool objects_ = false, selection_ = false;
};

class MArgList {
private:
  friend class MArgDatabase;
  friend struct fake::Call;
  std::vector<std::string> words_;
};

class MArgDatabase {
public:
  MArgDatabase(const MSyntax &syntax, const MArgList &argList, MStatus *ReturnStatus = NULL);
  bool isFlagSet(const char *flag, MStatus *ReturnStatus = NULL) const;
  MStatus getFlagArgument(const char *flag, unsigned int index, MString &result) const;
  MStatus getObjects(MSelectionList &result) const;

private:
  std::vector<std::string> flags_;
  std::map<std::string, std::string> texts_;  // of flags
  MSelectionList objects_;
};

class MPxCommand {
public:
  MPxCommand();
  virtual ~MPxCommand();
  virtual MStatus doIt(const MArgList &args);
  virtual MStatus undoIt();
  virtual MStatus redoIt();
  virtual bool isUndoable() const;
  virtual bool hasSyntax() const;
  MSyntax syntax() const { return syntax_; }
  static void displayError(const MString &theError, bool showLineNumber = false);
  static void setResult(const char *val);
  static void appendToResult(const char *val);

private:
  friend struct fake::Call;
  MSyntax syntax_;
};
typedef MSyntax (*MCreateSyntaxFunction)();

class MFnPlugin : public MFnBase {
public:
  MFnPlugin(MObject &object, const char *vendor = "Unknown", const char *version = "Unknown",
            const char *requiredApiVersion = "Any", MStatus *ReturnStatus = 0L);
  MStatus registerNode(const MString &typeName, const MTypeId &typeId, MCreatorFunction creatorFunction,
                       MInitializeFunction initFunction, MPxNode::Type type = MPxNode::kDependNode,
                       const MString *classification = NULL);
  MStatus deregisterNode(const MTypeId &typeId);
  MStatus registerCommand(const MString &commandName, MCreatorFunction creatorFunction,
                          MCreateSyntaxFunction createSyntaxFunction = NULL);
  MStatus deregisterCommand(const MString &commandName);
  MStatus registerUI(const MString &creationProc, const MString &deletionProc, const MString &creationBatchProc = "",
                     const MString &deletionBatchProc = "");
};

class MGlobal {
public:
  enum MMayaState { kInteractive, kBatch, kLibraryApp, kBaseUIMode };
  static MMayaState mayaState(MStatus *ReturnStatus = NULL);
  static MStatus executeCommandOnIdle(const MString &command, bool displayEnabled = false);
  static void displayError(const MString &theError, bool showLineNumber = false);
  static void displayWarning(const MString &theWarning, bool showLineNumber = false);
  static MStatus executeCommand(const MString &command, bool displayEnabled = false, bool undoEnabled = false);
};

class MComputation {
public:
  MComputation();
  virtual ~MComputation();
  void beginComputation(bool showProgressBar = false, bool isInterruptable = true, bool useWaitCursor = true);
  bool isInterruptRequested();
  void setProgressRange(const int minValue, const int maxValue);
  void setProgress(const int amount);
  void setProgressStatus(const MString &);
  void endComputation();
};
