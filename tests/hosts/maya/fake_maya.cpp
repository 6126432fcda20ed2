#include "fake_object.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>

// ------------------------------------------------------------------------------------------------------------- objects

namespace fake {

struct MeshData : Object {
  explicit MeshData(Mesh m) : Object(MFn::kMeshData), mesh(std::move(m)) {}
  Mesh mesh;
};
struct CurveData : Object {
  CurveData() : Object(MFn::kInvalid) {}
};
struct Component : Object {
  Component(MFn::Type kind, std::vector<int> list) : Object(kind), elements(std::move(list)) {}
  std::vector<int> elements;
};
struct ComponentList : Object {
  ComponentList() : Object(MFn::kComponentListData) {}
  std::vector<MObject> components;
};

enum class Kind { boolean, short_int, integer, real32, real64, triple, time, matrix, data, compound };

struct Attribute : Object {
  Attribute() : Object(MFn::kAttribute) {}
  std::string name, brief;
  Kind kind = Kind::real64;
  double value = 0, least = -1e300, most = 1e300;
  bool array = false, keyable = false, built = false;
  std::vector<Attribute *> children;
  std::map<std::string, int> fields;
  Attribute *parent = nullptr;
};

// Of one attribute on one node.
struct Value {
  Attribute *attribute = nullptr;
  bool boolean = false;
  short short_int = 0;
  int integer = 0;
  float real32 = 0;
  double real64 = 0;
  double3 triple = {0, 0, 0};
  MTime time;
  MMatrix matrix;
  MObject data;
  MString text;
  std::map<unsigned int, Value> elements;
  std::map<const Attribute *, Value> children;

  static Value make(Attribute *attribute, bool element) {
    Value v;
    v.attribute = attribute;
    if (attribute->array && !element) return v;
    v.set(attribute->value);
    for (Attribute *child : attribute->children) v.children[child] = make(child, false);
    v.gather();
    return v;
  }
  Value &element(unsigned int index) {
    const auto found = elements.find(index);
    return found != elements.end() ? found->second : elements.emplace(index, make(attribute, true)).first->second;
  }
  void set(double x) {
    boolean = x != 0;
    short_int = static_cast<short>(x);
    integer = static_cast<int>(x);
    real32 = static_cast<float>(x);
    real64 = x;
  }
  // A triple mirrors its children.
  void gather() {
    if (attribute->kind != Kind::triple) return;
    for (std::size_t k = 0; k < 3; ++k) triple[k] = children[attribute->children[k]].real64;
  }
};

struct Type {
  std::string name;
  unsigned int id = 0;
  MCreatorFunction create = nullptr;
  std::vector<Attribute *> attributes;
  std::set<const Attribute *> affects_output;
};

namespace {

std::vector<std::shared_ptr<Attribute>> all_attributes;
std::map<std::string, Type> types;
Type *being_initialized = nullptr;
MTime::Unit ui_unit = MTime::kFilm;

MObject base(const char *name, const char *brief, Kind kind, double value, bool array,
             std::vector<MObject> children = {}) {
  auto attribute = std::make_shared<Attribute>();
  attribute->name = name;
  attribute->brief = brief;
  attribute->kind = kind;
  attribute->value = value;
  attribute->array = array;
  for (const MObject &child : children) {
    attribute->children.push_back(Object::get<Attribute>(child));
    attribute->children.back()->parent = attribute.get();
  }
  all_attributes.push_back(attribute);
  return Object::wrap(attribute);
}

}  // namespace

Session &session() {
  static Session only;
  return only;
}

struct Node {
  Type *type = nullptr;
  std::unique_ptr<MPxDeformerNode> user;
  std::map<const Attribute *, Value> values;
  std::map<unsigned int, std::vector<int>> members;
  std::map<unsigned int, MMatrix> matrices;
  std::map<unsigned int, std::vector<MPoint>> output;
  std::set<unsigned int> clean;
  bool failed = false;
  int calls = 0;

  explicit Node(const std::string &name, const std::string &own_name) {
    const auto found = types.find(name);
    if (found == types.end()) throw std::runtime_error("no node type " + name);
    type = &found->second;
    for (const MObject *attribute : {&MPxDeformerNode::input, &MPxDeformerNode::weightList, &MPxDeformerNode::envelope})
      add(Object::get<Attribute>(*attribute));
    for (Attribute *attribute : type->attributes) add(attribute);
    user.reset(static_cast<MPxDeformerNode *>(type->create()));
    user->name_ = own_name.empty() ? name + "1" : own_name;
    user->self_ = Object::wrap(std::make_shared<NodeObject>(MFn::kPluginDeformerNode, user->name_));
  }
  void add(Attribute *attribute) { values[attribute] = Value::make(attribute, false); }

  Value &value(const MObject &attribute) { return values.at(Object::get<Attribute>(attribute)); }

  // Maya passes a change on from a child to its parents, but an output is told only by what affects it.
  void dirty(const Attribute *attribute) {
    const Attribute *top = attribute;
    while (top->parent) top = top->parent;
    const bool of_base = top == Object::get<Attribute>(MPxDeformerNode::envelope) ||
                         top == Object::get<Attribute>(MPxDeformerNode::weightList);
    if (of_base || type->affects_output.count(attribute)) clean.clear();
  }

  Value *find(const std::string &plug, Attribute *&attribute) {
    Value *at = nullptr;
    std::size_t from = 0;
    while (from < plug.size()) {
      const std::size_t end = std::min(plug.find('.', from), plug.size());
      std::string part = plug.substr(from, end - from);
      from = end + 1;
      long index = -1;
      const std::size_t bracket = part.find('[');
      if (bracket != std::string::npos) {
        index = std::strtol(part.c_str() + bracket + 1, nullptr, 10);
        part.resize(bracket);
      }
      at = at ? child(*at, part) : top(part);
      if (!at) throw std::runtime_error("no attribute " + plug + " on " + type->name);
      attribute = at->attribute;
      if (index >= 0) at = &at->element(static_cast<unsigned int>(index));
    }
    return at;
  }
  static Value *child(Value &value, const std::string &name) {
    for (auto &[attribute, v] : value.children)
      if (attribute->name == name) return &v;
    return nullptr;
  }
  Value *top(const std::string &name) {
    for (auto &[attribute, v] : values) {
      if (attribute->name == name) return &v;
      if (!attribute->array)
        if (Value *inner = child(v, name)) return inner;
    }
    return nullptr;
  }

  const std::vector<MPoint> &evaluate(unsigned int index) {
    if (clean.count(index)) return output[index];
    Value &in = value(MPxDeformerNode::input).element(index);
    const MObject geometry = in.children.at(Object::get<Attribute>(MPxDeformerNode::inputGeom)).data;
    std::vector<MPoint> points;
    if (const MeshData *mesh = Object::get<MeshData>(geometry)) points = mesh->mesh.points;
    const std::vector<MPoint> before = points;
    std::vector<int> set = members[index];
    if (set.empty())
      for (std::size_t i = 0; i < points.size(); ++i) set.push_back(static_cast<int>(i));
    MDataBlock block(*this);
    MItGeometry iterator(points, set);
    ++calls;
    failed = user->deform(block, iterator, matrices[index], index) != MS::kSuccess;
    output[index] = failed ? before : points;
    clean.insert(index);
    return output[index];
  }
};

// ------------------------------------------------------------------------------------------------------------ deformer

Deformer::Deformer(const std::string &type_name, const std::string &name)
    : node_(std::make_unique<Node>(type_name, name)) {}
Deformer::~Deformer() = default;

void Deformer::set(const std::string &plug, double x) {
  Attribute *attribute = nullptr;
  Value *value = node_->find(plug, attribute);
  if (x < attribute->least || x > attribute->most) throw std::runtime_error("out of range: " + plug);
  value->set(x);
  for (auto &[a, v] : node_->values) {
    (void)a;
    v.gather();
  }
  node_->dirty(attribute);
}

void Deformer::set(const std::string &plug, const MMatrix &x) {
  Attribute *attribute = nullptr;
  node_->find(plug, attribute)->matrix = x;
  node_->dirty(attribute);
}

void Deformer::set_text(const std::string &plug, const std::string &text) {
  Attribute *attribute = nullptr;
  node_->find(plug, attribute)->text = text.c_str();
  node_->dirty(attribute);
}

std::string Deformer::get_text(const std::string &plug) {
  Attribute *attribute = nullptr;
  return node_->find(plug, attribute)->text.asChar();
}

void Deformer::set_time(double value, MTime::Unit unit) {
  Attribute *attribute = nullptr;
  node_->find("time", attribute)->time = MTime(value, unit);
  node_->dirty(attribute);
}

void Deformer::set_components(const std::string &plug, const std::vector<int> &vertices, bool edges) {
  auto list = std::make_shared<ComponentList>();
  list->components.push_back(
      Object::wrap(std::make_shared<Component>(edges ? MFn::kMeshEdgeComponent : MFn::kMeshVertComponent, vertices)));
  Attribute *attribute = nullptr;
  node_->find(plug, attribute)->data = Object::wrap(list);
  node_->dirty(attribute);
}

void Deformer::set_mesh(const std::string &plug, const Mesh *mesh) {
  Attribute *attribute = nullptr;
  node_->find(plug, attribute)->data = mesh ? Object::wrap(std::make_shared<MeshData>(*mesh)) : MObject::kNullObj;
  node_->dirty(attribute);
}

void Deformer::remove(const std::string &plug) {
  Attribute *attribute = nullptr;
  const std::size_t bracket = plug.find('[');
  node_->find(plug.substr(0, bracket), attribute)
      ->elements.erase(static_cast<unsigned int>(std::strtol(plug.c_str() + bracket + 1, nullptr, 10)));
  node_->dirty(attribute);
}

void Deformer::connect(unsigned int index, const Mesh *mesh) {
  Attribute *geometry = Object::get<Attribute>(MPxDeformerNode::inputGeom);
  MObject data = mesh ? Object::wrap(std::make_shared<MeshData>(*mesh)) : Object::wrap(std::make_shared<CurveData>());
  node_->value(MPxDeformerNode::input).element(index).children[geometry].data = data;
  node_->clean.clear();
}

void Deformer::set_members(unsigned int index, std::vector<int> members) {
  node_->members[index] = std::move(members);
  node_->clean.clear();
}

void Deformer::set_world_matrix(unsigned int index, const MMatrix &matrix) { node_->matrices[index] = matrix; }

const std::vector<MPoint> &Deformer::evaluate(unsigned int index) { return node_->evaluate(index); }
bool Deformer::failed() const { return node_->failed; }
int Deformer::deform_calls() const { return node_->calls; }
MPxDeformerNode &Deformer::user() { return *node_->user; }
unsigned int Deformer::type_id() const { return node_->type->id; }
std::vector<unsigned int> Deformer::elements(const std::string &array) const {
  Attribute *attribute = nullptr;
  std::vector<unsigned int> out;
  for (const auto &[index, value] : node_->find(array, attribute)->elements) out.push_back(index);
  return out;
}
double Deformer::get(const std::string &plug) {
  Attribute *attribute = nullptr;
  const Value &value = *node_->find(plug, attribute);
  return attribute->kind == Kind::integer  ? value.integer
         : attribute->kind == Kind::real32 ? static_cast<double>(value.real32)
                                           : value.real64;
}
std::function<void()> Deformer::remember(const std::string &plug) {
  Attribute *attribute = nullptr;
  Value *value = node_->find(plug.substr(0, plug.find_first_of("[.")), attribute);
  const Value before = *value;
  return [=] {
    *value = before;
    node_->dirty(attribute);
  };
}

std::vector<AttributeInfo> Deformer::attributes() const {
  std::vector<AttributeInfo> out;
  const auto add = [&](const Attribute *a) {
    const std::string paint = "deformer " + node_->type->name + " " + a->name;
    const bool paintable = std::any_of(session().commands.begin(), session().commands.end(),
                                       [&](const std::string &c) {
                                         return c.size() >= paint.size() && c.compare(c.size() - paint.size(), paint.size(), paint) == 0;
                                       });
    out.push_back({a->name, a->brief, a->parent ? a->parent->name : "", a->keyable, a->array,
                   node_->type->affects_output.count(a) > 0, paintable, a->fields});
  };
  for (const Attribute *attribute : node_->type->attributes) {
    add(attribute);
    for (const Attribute *child : attribute->children) add(child);
  }
  return out;
}

MObject component_of(MFn::Type kind, const std::vector<int> &elements) {
  return Object::wrap(std::make_shared<Component>(kind, elements));
}
std::string attribute_name(const MObject &attribute) {
  if (const Attribute *known = Object::get<Attribute>(attribute)) return known->name;
  return Object::get<NodeObject>(attribute)->name;
}

// ------------------------------------------------------------------------------------------------------------- plug-in

Plugin::Plugin(const std::string &path) {
  library_ = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library_) throw std::runtime_error(dlerror());
  // The names that a C++ compiler gives to initializePlugin(MObject) and uninitializePlugin(MObject).
  const auto start = reinterpret_cast<MStatus (*)(MObject)>(dlsym(library_, "_Z16initializePlugin7MObject"));
  if (!start) throw std::runtime_error("no initializePlugin in " + path);
  if (start(MObject()) != MS::kSuccess) throw std::runtime_error("initializePlugin failed");
}

Plugin::~Plugin() {
  const auto stop = reinterpret_cast<MStatus (*)(MObject)>(dlsym(library_, "_Z18uninitializePlugin7MObject"));
  if (stop) stop(MObject());
  dlclose(library_);
}

}  // namespace fake

using fake::Attribute;
using fake::Kind;
using fake::Object;
using fake::Value;

namespace {

void report(MStatus *out, bool good) {
  if (out) *out = good ? MS::kSuccess : MS::kFailure;
}

double seconds_of(MTime::Unit unit) {
  switch (unit) {
    case MTime::kHours:
      return 3600;
    case MTime::kMinutes:
      return 60;
    case MTime::kMilliseconds:
      return 1e-3;
    case MTime::kGames:
      return 1.0 / 15;
    case MTime::kFilm:
      return 1.0 / 24;
    case MTime::kPALFrame:
      return 1.0 / 25;
    case MTime::kNTSCFrame:
      return 1.0 / 30;
    default:
      return 1;
  }
}

// A wrong access in Maya is undefined; here it ends the test.
Value &checked(Value *value, Kind kind, const char *what) {
  if (value && value->attribute->kind == kind) return *value;
  std::cerr << "fake Maya: " << what << " of " << (value ? value->attribute->name : "nothing") << std::endl;
  std::abort();
}

}  // namespace

// -------------------------------------------------------------------------------------------------------- plain values

MTime::MTime(double time, Unit unit) : seconds_(time * seconds_of(unit)) {}
double MTime::as(Unit unit) const { return seconds_ / seconds_of(unit); }
MTime::Unit MTime::uiUnit() { return fake::ui_unit; }
MStatus MTime::setUIUnit(Unit unit) {
  fake::ui_unit = unit;
  return MS::kSuccess;
}

MMatrix::MMatrix() {
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) matrix[i][j] = i == j;
}
MMatrix::MMatrix(const double m[4][4]) { std::copy(&m[0][0], &m[0][0] + 16, &matrix[0][0]); }

MObject MObject::kNullObj;
bool MObject::hasFn(MFn::Type fs) const { return object_ && object_->fn == fs; }

MFnBase::~MFnBase() = default;

// ---------------------------------------------------------------------------------------------------------------- data

double MDistance::internalToUI(double value) { return value * fake::scene().units; }

MFnMesh::MFnMesh(const MObject &object, MStatus *status) : object_(object) {
  report(status, Object::get<fake::MeshData>(object) != nullptr);
}
MStatus MFnMesh::getPoints(MPointArray &points, MSpace::Space) const {
  points.clear();
  for (const MPoint &p : Object::get<fake::MeshData>(object_)->mesh.points) points.append(p);
  return MS::kSuccess;
}
MStatus MFnMesh::getVertices(MIntArray &counts, MIntArray &list) const {
  const fake::Mesh &mesh = Object::get<fake::MeshData>(object_)->mesh;
  counts.clear();
  list.clear();
  for (const int n : mesh.counts) counts.append(n);
  for (const int i : mesh.corners) list.append(i);
  return MS::kSuccess;
}

// Edges are numbered as they first come up round the polygons.
MStatus MFnMesh::getEdgeVertices(int edge, int2 &ends) const {
  const fake::Mesh &mesh = Object::get<fake::MeshData>(object_)->mesh;
  std::set<std::pair<int, int>> known;
  std::size_t from = 0;
  for (const int n : mesh.counts) {
    for (int k = 0; k < n; ++k) {
      const int a = mesh.corners[from + std::size_t(k)], b = mesh.corners[from + std::size_t((k + 1) % n)];
      if (!known.emplace(std::min(a, b), std::max(a, b)).second) continue;
      if (edge-- > 0) continue;
      ends[0] = a, ends[1] = b;
      return MS::kSuccess;
    }
    from += std::size_t(n);
  }
  return MS::kInvalidParameter;
}
MStatus MFnMesh::getUVs(MFloatArray &us, MFloatArray &vs, const MString *set) const {
  const fake::Mesh &mesh = Object::get<fake::MeshData>(object_)->mesh;
  us.clear(), vs.clear();
  if (!set || mesh.uv_set != set->asChar()) return MS::kFailure;
  for (std::size_t i = 0; i < mesh.us.size(); ++i) us.append(mesh.us[i]), vs.append(mesh.vs[i]);
  return MS::kSuccess;
}
MStatus MFnMesh::getAssignedUVs(MIntArray &counts, MIntArray &ids, const MString *set) const {
  const fake::Mesh &mesh = Object::get<fake::MeshData>(object_)->mesh;
  counts.clear(), ids.clear();
  if (!set || mesh.uv_set != set->asChar()) return MS::kFailure;
  for (const int n : mesh.counts) counts.append(n);
  for (std::size_t i = 0; i < mesh.us.size(); ++i) ids.append(int(i));
  return MS::kSuccess;
}

MFnComponentListData::MFnComponentListData(const MObject &object, MStatus *status) : object_(object) {
  report(status, Object::get<fake::ComponentList>(object) != nullptr);
}
unsigned int MFnComponentListData::length(MStatus *) const {
  return static_cast<unsigned int>(Object::get<fake::ComponentList>(object_)->components.size());
}
MObject MFnComponentListData::operator[](unsigned int index) const {
  return Object::get<fake::ComponentList>(object_)->components.at(index);
}

MFnSingleIndexedComponent::MFnSingleIndexedComponent(const MObject &object, MStatus *status) : object_(object) {
  report(status, Object::get<fake::Component>(object) != nullptr);
}
MStatus MFnSingleIndexedComponent::getElements(MIntArray &elements) const {
  elements.clear();
  for (const int i : Object::get<fake::Component>(object_)->elements) elements.append(i);
  return MS::kSuccess;
}

// ---------------------------------------------------------------------------------------------------------- attributes

MFnAttribute::MFnAttribute(const MObject &object, MStatus *status) : object_(object) {
  report(status, Object::get<Attribute>(object) != nullptr);
}
Attribute &MFnAttribute::start(const MString &name, const MString &brief, MStatus *status) {
  auto attribute = std::make_shared<Attribute>();
  attribute->name = name.asChar();
  attribute->brief = brief.asChar();
  fake::all_attributes.push_back(attribute);
  object_ = Object::wrap(attribute);
  report(status, true);
  return *attribute;
}
Attribute &MFnAttribute::made() const { return *Object::get<Attribute>(object_); }
MStatus MFnAttribute::setKeyable(bool state) {
  made().keyable = state;
  return MS::kSuccess;
}
MStatus MFnAttribute::setChannelBox(bool) { return MS::kSuccess; }
MStatus MFnAttribute::setArray(bool state) {
  made().array = state;
  return MS::kSuccess;
}
MStatus MFnAttribute::setUsesArrayDataBuilder(bool state) {
  made().built = state;
  return MS::kSuccess;
}

MObject MFnNumericAttribute::create(const MString &name, const MString &brief, MFnNumericData::Type type, double value,
                                    MStatus *status) {
  Attribute &a = start(name, brief, status);
  a.value = value;
  a.kind = type == MFnNumericData::kBoolean ? Kind::boolean
           : type == MFnNumericData::kInt   ? Kind::integer
           : type == MFnNumericData::kFloat ? Kind::real32
                                            : Kind::real64;
  return object_;
}
MObject MFnNumericAttribute::create(const MString &name, const MString &brief, const MObject &x, const MObject &y,
                                    const MObject &z, MStatus *status) {
  Attribute &a = start(name, brief, status);
  a.kind = Kind::triple;
  for (const MObject *child : {&x, &y, &z}) {
    a.children.push_back(Object::get<Attribute>(*child));
    a.children.back()->parent = &a;
  }
  return object_;
}
MStatus MFnNumericAttribute::setMin(double value) {
  made().least = value;
  return MS::kSuccess;
}
MStatus MFnNumericAttribute::setMax(double value) {
  made().most = value;
  return MS::kSuccess;
}
MStatus MFnNumericAttribute::setSoftMax(double) { return MS::kSuccess; }

MObject MFnUnitAttribute::create(const MString &name, const MString &brief, MFnUnitAttribute::Type, double,
                                 MStatus *status) {
  start(name, brief, status).kind = Kind::time;
  return object_;
}

MObject MFnEnumAttribute::create(const MString &name, const MString &brief, short value, MStatus *status) {
  Attribute &a = start(name, brief, status);
  a.kind = Kind::short_int;
  a.value = value;
  a.least = a.most = 0;
  return object_;
}
MStatus MFnEnumAttribute::addField(const MString &field, short index) {
  made().fields[field.asChar()] = index;
  made().most = std::max<double>(made().most, index);
  return MS::kSuccess;
}

MObject MFnMatrixAttribute::create(const MString &name, const MString &brief, Type, MStatus *status) {
  start(name, brief, status).kind = Kind::matrix;
  return object_;
}

MObject MFnTypedAttribute::create(const MString &name, const MString &brief, MFnData::Type, MObject, MStatus *status) {
  start(name, brief, status).kind = Kind::data;
  return object_;
}

MStatus MFnTypedAttribute::setUsedAsFilename(bool) { return MS::kSuccess; }

MObject MFnCompoundAttribute::create(const MString &name, const MString &brief, MStatus *status) {
  start(name, brief, status).kind = Kind::compound;
  return object_;
}
MStatus MFnCompoundAttribute::addChild(const MObject &child) {
  made().children.push_back(Object::get<Attribute>(child));
  made().children.back()->parent = &made();
  return MS::kSuccess;
}

// --------------------------------------------------------------------------------------------------------- data handles

MObject MDataHandle::data() { return value_->data; }
bool &MDataHandle::asBool() const { return checked(value_, Kind::boolean, "asBool").boolean; }
short &MDataHandle::asShort() const { return checked(value_, Kind::short_int, "asShort").short_int; }
int &MDataHandle::asInt() const { return checked(value_, Kind::integer, "asInt").integer; }
float &MDataHandle::asFloat() const { return checked(value_, Kind::real32, "asFloat").real32; }
double &MDataHandle::asDouble() const { return checked(value_, Kind::real64, "asDouble").real64; }
MTime MDataHandle::asTime() const { return checked(value_, Kind::time, "asTime").time; }
double3 &MDataHandle::asDouble3() const { return checked(value_, Kind::triple, "asDouble3").triple; }
MMatrix &MDataHandle::asMatrix() const { return checked(value_, Kind::matrix, "asMatrix").matrix; }
MObject MDataHandle::asMesh() const {
  return Object::get<fake::MeshData>(value_->data) ? value_->data : MObject::kNullObj;
}
MString &MDataHandle::asString() const { return value_->text; }
MDataHandle MDataHandle::child(const MObject &attribute) {
  return MDataHandle(&value_->children.at(Object::get<Attribute>(attribute)));
}

MArrayDataHandle::MArrayDataHandle(const MDataHandle &in, MStatus *status)
    : value_(in.value_), at_(value_->elements.begin()) {
  report(status, value_->attribute->array);
}
MDataHandle MArrayDataHandle::inputValue(MStatus *status) {
  report(status, at_ != value_->elements.end());
  return MDataHandle(at_ == value_->elements.end() ? nullptr : &at_->second);
}
MDataHandle MArrayDataHandle::outputValue(MStatus *status) { return inputValue(status); }
MStatus MArrayDataHandle::next() {
  if (at_ != value_->elements.end()) ++at_;
  return at_ != value_->elements.end() ? MS::kSuccess : MS::kFailure;
}
unsigned int MArrayDataHandle::elementCount(MStatus *status) {
  report(status, true);
  return static_cast<unsigned int>(value_->elements.size());
}
unsigned int MArrayDataHandle::elementIndex(MStatus *status) {
  report(status, at_ != value_->elements.end());
  return at_->first;
}
MStatus MArrayDataHandle::jumpToElement(unsigned int index) {
  const auto found = value_->elements.find(index);
  if (found == value_->elements.end()) return MS::kFailure;
  at_ = found;
  return MS::kSuccess;
}

MDataBlock::~MDataBlock() = default;
MDataHandle MDataBlock::inputValue(const MObject &attribute, MStatus *status) {
  report(status, true);
  return MDataHandle(&node_.value(attribute));
}
MArrayDataHandle MDataBlock::inputArrayValue(const MObject &attribute, MStatus *status) {
  return MArrayDataHandle(MDataHandle(&node_.value(attribute)), status);
}
MArrayDataHandle MDataBlock::outputArrayValue(const MObject &attribute, MStatus *status) {
  return inputArrayValue(attribute, status);
}

MItGeometry::~MItGeometry() = default;
bool MItGeometry::isDone(MStatus *) const { return at_ >= members_.size(); }
MStatus MItGeometry::next() {
  ++at_;
  return MS::kSuccess;
}
int MItGeometry::index(MStatus *) const { return members_.at(at_); }
int MItGeometry::count(MStatus *) const { return static_cast<int>(members_.size()); }
MStatus MItGeometry::allPositions(MPointArray &points, MSpace::Space) const {
  points.clear();
  for (const int i : members_) points.append(points_.at(static_cast<std::size_t>(i)));
  return MS::kSuccess;
}
MStatus MItGeometry::setAllPositions(const MPointArray &points, MSpace::Space) {
  if (points.length() != members_.size()) return MS::kInvalidParameter;
  for (std::size_t k = 0; k < members_.size(); ++k)
    points_.at(static_cast<std::size_t>(members_[k])) = points[static_cast<unsigned int>(k)];
  return MS::kSuccess;
}

// --------------------------------------------------------------------------------------------------------------- nodes

MObject MPxDeformerNode::inputGeom = fake::base("inputGeometry", "ig", Kind::data, 0, false);
MObject MPxDeformerNode::input = fake::base("input", "ip", Kind::compound, 0, true, {MPxDeformerNode::inputGeom});
MObject MPxDeformerNode::outputGeom = fake::base("outputGeometry", "og", Kind::data, 0, true);
MObject MPxDeformerNode::weights = fake::base("weights", "w", Kind::real32, 1, true);
MObject MPxDeformerNode::weightList =
    fake::base("weightList", "wl", Kind::compound, 0, true, {MPxDeformerNode::weights});
MObject MPxDeformerNode::envelope = fake::base("envelope", "en", Kind::real32, 1, false);

MPxNode::MPxNode() = default;
MPxNode::~MPxNode() = default;
MString MPxNode::name() const { return name_.c_str(); }
MStatus MPxNode::addAttribute(const MObject &attr) {
  Attribute *attribute = Object::get<Attribute>(attr);
  if (!attribute || !fake::being_initialized) return MS::kFailure;
  fake::being_initialized->attributes.push_back(attribute);
  return MS::kSuccess;
}
MStatus MPxNode::attributeAffects(const MObject &whenChanges, const MObject &isAffected) {
  Attribute *attribute = Object::get<Attribute>(whenChanges);
  if (!attribute || !(isAffected == MPxDeformerNode::outputGeom)) return MS::kFailure;
  // Both must be on the node, by themselves or with a parent, before one can affect the other.
  const auto &added = fake::being_initialized->attributes;
  Attribute *top = attribute;
  while (top->parent) top = top->parent;
  if (std::find(added.begin(), added.end(), top) == added.end()) return MS::kFailure;
  fake::being_initialized->affects_output.insert(attribute);
  return MS::kSuccess;
}

MPxDeformerNode::MPxDeformerNode() = default;
MPxDeformerNode::~MPxDeformerNode() = default;
MStatus MPxDeformerNode::deform(MDataBlock &, MItGeometry &, const MMatrix &, unsigned int) { return MS::kSuccess; }
float MPxDeformerNode::weightValue(MDataBlock &block, unsigned int multiIndex, unsigned int wtIndex) {
  MArrayDataHandle list = block.inputArrayValue(weightList);
  if (list.jumpToElement(multiIndex) != MS::kSuccess) return 1;
  MArrayDataHandle map(list.inputValue().child(weights));
  return map.jumpToElement(wtIndex) == MS::kSuccess ? map.inputValue().asFloat() : 1;
}

MFnPlugin::MFnPlugin(MObject &, const char *, const char *, const char *, MStatus *status) { report(status, true); }
MStatus MFnPlugin::registerNode(const MString &name, const MTypeId &id, MCreatorFunction create,
                                MInitializeFunction start, MPxNode::Type type, const MString *) {
  if (type != MPxNode::kDeformerNode || fake::types.count(name.asChar())) return MS::kFailure;
  fake::Type &added = fake::types[name.asChar()];
  added.name = name.asChar();
  added.id = id.id();
  added.create = create;
  fake::being_initialized = &added;
  const MStatus status = start();
  fake::being_initialized = nullptr;
  return status;
}
MStatus MFnPlugin::deregisterNode(const MTypeId &id) {
  for (auto it = fake::types.begin(); it != fake::types.end(); ++it)
    if (it->second.id == id.id()) {
      fake::types.erase(it);
      return MS::kSuccess;
    }
  return MS::kFailure;
}

MStatus MPxDeformerNode::accessoryNodeSetup(MDagModifier &) { return MS::kSuccess; }

namespace {

const std::thread::id main_thread = std::this_thread::get_id();
std::mutex idle_mutex;

void main_thread_only(const char *call) {
  if (std::this_thread::get_id() == main_thread) return;
  const std::lock_guard<std::mutex> lock(idle_mutex);
  fake::session().off_thread.push_back(call);
}

}  // namespace

MTimeRange MPxNode::transformInvalidationRange(const MPlug &, const MTimeRange &input) const { return input; }

MGlobal::MMayaState MGlobal::mayaState(MStatus *) { return kInteractive; }
void MGlobal::displayError(const MString &text, bool) {
  main_thread_only("displayError");
  fake::session().errors.push_back(text.asChar());
}
void MGlobal::displayWarning(const MString &text, bool) {
  main_thread_only("displayWarning");
  fake::session().warnings.push_back(text.asChar());
}
// The stand-in is always idle.
MStatus MGlobal::executeCommandOnIdle(const MString &command, bool) {
  const std::string text = command.asChar();
  const std::string word = text.substr(0, text.find(' ')), told = text.substr(text.find(' ') + 2);
  const std::lock_guard<std::mutex> lock(idle_mutex);
  (word == "error" ? fake::session().errors : fake::session().warnings).push_back(told.substr(0, told.size() - 1));
  return MS::kSuccess;
}
MStatus MGlobal::executeCommand(const MString &command, bool, bool) {
  fake::session().commands.push_back(command.asChar());
  return MS::kSuccess;
}

MComputation::MComputation() = default;
MComputation::~MComputation() = default;
void MComputation::beginComputation(bool bar, bool, bool) {
  main_thread_only("beginComputation");
  fake::session().bar = bar;
  ++fake::session().computations_open;
}
bool MComputation::isInterruptRequested() { return ++fake::session().interrupt_polls == fake::session().interrupt_at; }
void MComputation::setProgressRange(const int least, const int most) {
  if (least != 0 || most != 100) throw std::runtime_error("the stand-in's bar goes from 0 to 100");
}
void MComputation::setProgress(const int amount) {
  main_thread_only("setProgress");
  if (fake::session().bar && !fake::session().progress.empty()) fake::session().progress.back().second.push_back(amount);
}
void MComputation::setProgressStatus(const MString &text) {
  main_thread_only("setProgressStatus");
  if (fake::session().bar) fake::session().progress.emplace_back(text.asChar(), std::vector<int>());
}
void MComputation::endComputation() { --fake::session().computations_open; }
