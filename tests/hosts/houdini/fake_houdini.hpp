// A stand-in for the part of the Houdini Development Kit that SOP_ShellWarp uses, to cook the node where there is no Houdini.
//
// Declarations follow the HDK's headers as published with public plug-ins' sources: SOP_NodeVerb, SOP_Node, PRM_TemplateBuilder,
// PRM_ChoiceList, UT_AutoInterrupt, GA_Primitive and GEO_Detail of Houdini 16; and SideFX's sample SOP_Star of 2021 (Houdini 19) for the shape of
// a verb, the embedded dialog script and the names of accessors; read declaration by declaration, not compiled against. GA_Handle,
// GA_Iterator, findPointGroup and containsOffset are as plug-ins for Houdini 16 to 20 call them. Only what the SOP uses is
// declared; everything below "private:" and in namespace fake is ours. As in Houdini, points are reached by offsets, which are
// not their indices: here an offset is 2 index + 3.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

typedef int64_t exint;
typedef int64_t int64;
typedef double fpreal;
typedef exint GA_Offset;
typedef exint GA_Index;
typedef exint GA_Size;

class GU_Detail;
class OP_Network;
class OP_Node;
class OP_Operator;
class OP_OperatorTable;
class OP_Context;
class PRM_Template;
class SOP_Node;
class SOP_NodeVerb;
class UT_SourceLocation;

namespace fake {
struct Geometry;
struct Parm;
struct Cook;
}  // namespace fake

// -------------------------------------------------------------------------------------------------------------- values

class UT_StringHolder {
public:
  UT_StringHolder() = default;
  UT_StringHolder(const char *text) : text_(text) {}
  const char *c_str() const { return text_.c_str(); }
  bool isstring() const { return !text_.empty(); }

private:
  std::string text_;
};
typedef UT_StringHolder UT_StringRef;

template <class T>
class UT_Vector3T {
public:
  UT_Vector3T() = default;
  UT_Vector3T(T vx, T vy, T vz) : v{vx, vy, vz} {}
  T x() const { return v[0]; }
  T y() const { return v[1]; }
  T z() const { return v[2]; }

private:
  T v[3] = {};
};
typedef UT_Vector3T<float> UT_Vector3;
typedef UT_Vector3T<double> UT_Vector3D;

class UT_Quaternion {
public:
  UT_Quaternion() = default;
  UT_Quaternion(float qx, float qy, float qz, float qw) : v{qx, qy, qz, qw} {}
  float x() const { return v[0]; }
  float y() const { return v[1]; }
  float z() const { return v[2]; }
  float w() const { return v[3]; }

private:
  float v[4] = {0, 0, 0, 1};
};

class UT_AutoInterrupt {
public:
  UT_AutoInterrupt(const char *operation_name);
  ~UT_AutoInterrupt();
  bool wasInterrupted();
  bool wasInterrupted(int percent);

private:
  std::string name_;
};

// ------------------------------------------------------------------------------------------------------------ geometry

enum GA_AttributeOwner { GA_ATTRIB_VERTEX, GA_ATTRIB_POINT, GA_ATTRIB_PRIMITIVE, GA_ATTRIB_GLOBAL };
enum { GEO_PRIMPOLY = 1, GEO_PRIMSPHERE = 2 };

class GA_PrimitiveTypeId {
public:
  explicit GA_PrimitiveTypeId(int id) : id_(id) {}
  int get() const { return id_; }

private:
  int id_;
};

class GA_Range {
public:
  explicit GA_Range(std::vector<GA_Offset> offsets) : offsets_(std::move(offsets)) {}

private:
  friend class GA_Iterator;
  std::vector<GA_Offset> offsets_;
};

class GA_Iterator {
public:
  explicit GA_Iterator(const GA_Range &range) : offsets_(range.offsets_) {}
  bool atEnd() const { return at_ == offsets_.size(); }
  GA_Iterator &operator++() {
    ++at_;
    return *this;
  }
  GA_Offset operator*() const { return offsets_.at(at_); }

private:
  std::vector<GA_Offset> offsets_;
  std::size_t at_ = 0;
};

class GA_Attribute {
public:
  void bumpDataId() { ++bumps; }
  int bumps = 0;
};

enum GA_TypeInfo { GA_TYPE_VOID, GA_TYPE_VECTOR = 4 };

class GA_RWAttributeRef {
public:
  GA_RWAttributeRef() = default;
  bool isValid() const { return detail_ != nullptr; }
  void setTypeInfo(GA_TypeInfo type) const;

private:
  friend class GU_Detail;
  template <class T>
  friend class GA_RWHandleT;
  GU_Detail *detail_ = nullptr;
  std::string name_;
};

class GA_PointGroup {
public:
  bool containsOffset(GA_Offset offset) const { return offsets.count(offset) > 0; }
  std::set<GA_Offset> offsets;
};

class GA_Edge {
public:
  GA_Edge(GA_Offset p0, GA_Offset p1) : p0_(p0), p1_(p1) {}
  GA_Offset p0() const { return p0_; }
  GA_Offset p1() const { return p1_; }

private:
  GA_Offset p0_, p1_;
};

class GA_EdgeGroup {
public:
  class const_iterator {
  public:
    const_iterator(std::vector<GA_Edge>::const_iterator at, std::vector<GA_Edge>::const_iterator end) : at_(at), end_(end) {}
    bool atEnd() const { return at_ == end_; }
    const_iterator &operator++() {
      ++at_;
      return *this;
    }
    const GA_Edge *operator->() const { return &*at_; }

  private:
    std::vector<GA_Edge>::const_iterator at_, end_;
  };
  const_iterator begin() const { return const_iterator(edges.begin(), edges.end()); }
  std::vector<GA_Edge> edges;
};

class GA_Primitive {
public:
  virtual ~GA_Primitive();
  GA_PrimitiveTypeId getTypeId() const { return GA_PrimitiveTypeId(type); }
  GA_Size getVertexCount() const { return static_cast<GA_Size>(points.size()); }
  GA_Index getPointIndex(GA_Size i) const { return points.at(static_cast<std::size_t>(i)); }
  GA_Offset getVertexOffset(GA_Size i) const { return 2 * (first_vertex + i) + 3; }

  int type = GEO_PRIMPOLY;
  std::vector<GA_Index> points;
  mutable GA_Index first_vertex = 0;  // vertices are numbered along the primitives
};

class GEO_PrimPoly : public GA_Primitive {
public:
  bool isClosed() const { return closed; }
  bool closed = true;
};

class GU_Detail {
public:
  GU_Detail();
  ~GU_Detail();
  GU_Detail(const GU_Detail &);
  GU_Detail &operator=(const GU_Detail &);

  GA_Size getNumPoints() const;
  GA_Range getPointRange() const;
  GA_Range getPrimitiveRange() const;
  GA_Index pointIndex(GA_Offset offset) const;
  GA_Index primitiveIndex(GA_Offset offset) const;
  const GA_Primitive *getPrimitive(GA_Offset offset) const;
  UT_Vector3 getPos3(GA_Offset offset) const;
  void setPos3(GA_Offset offset, const UT_Vector3 &position);
  GA_Attribute *getP();
  GA_RWAttributeRef findFloatTuple(GA_AttributeOwner owner, const UT_StringRef &name, int min_size, int max_size);
  GA_RWAttributeRef addFloatTuple(GA_AttributeOwner owner, const UT_StringHolder &name, int tuple_size);

  fake::Geometry &fake_geometry() { return *geometry_; }
  const fake::Geometry &fake_geometry() const { return *geometry_; }

private:
  std::unique_ptr<fake::Geometry> geometry_;
};
typedef GU_Detail GA_Detail;

namespace fake {
// What a test fills in and looks at. Attributes of points: as many numbers for each as the attribute is wide.
struct Geometry {
  std::vector<UT_Vector3> points;
  std::vector<GEO_PrimPoly> primitives;
  std::map<std::string, std::vector<double>> attributes, of_primitives, of_vertices;
  std::map<std::string, std::vector<std::string>> texts_of_primitives;
  std::set<std::string> vectors;  // attributes that transform as such
  std::map<std::string, int> bumps;            // of attributes but P
  std::map<std::string, GA_PointGroup> groups;
  std::map<std::string, GA_EdgeGroup> edge_groups;
  GA_Attribute position;

  static GA_Offset offset(GA_Index index) { return 2 * index + 3; }
  void group(const std::string &name, const std::vector<int> &members);
  const double *find(GA_AttributeOwner owner, const std::string &name, GA_Offset offset, std::size_t width) const;
};
}  // namespace fake

template <class T>
class GA_ROHandleT {
public:
  GA_ROHandleT() = default;
  GA_ROHandleT(const GA_Detail *gdp, GA_AttributeOwner owner, const UT_StringRef &name)
      : detail_((owner == GA_ATTRIB_POINT && gdp->fake_geometry().attributes.count(name.c_str())) ||
                        (owner == GA_ATTRIB_PRIMITIVE && gdp->fake_geometry().of_primitives.count(name.c_str())) ||
                        (owner == GA_ATTRIB_VERTEX && gdp->fake_geometry().of_vertices.count(name.c_str()))
                    ? gdp
                    : nullptr),
        owner_(owner),
        name_(name.c_str()) {}
  bool isValid() const { return detail_ != nullptr; }
  T get(GA_Offset offset) const;

private:
  const GU_Detail *detail_ = nullptr;
  GA_AttributeOwner owner_ = GA_ATTRIB_POINT;
  std::string name_;
};
// Of texts of primitives.
template <>
class GA_ROHandleT<const char *> {
public:
  GA_ROHandleT() = default;
  GA_ROHandleT(const GA_Detail *gdp, GA_AttributeOwner owner, const UT_StringRef &name) {
    const auto &texts = gdp->fake_geometry().texts_of_primitives;
    const auto found = texts.find(name.c_str());
    if (owner == GA_ATTRIB_PRIMITIVE && found != texts.end()) values_ = &found->second;
  }
  bool isValid() const { return values_ != nullptr; }
  const char *get(GA_Offset offset) const { return values_->at(static_cast<std::size_t>((offset - 3) / 2)).c_str(); }

private:
  const std::vector<std::string> *values_ = nullptr;
};
typedef GA_ROHandleT<const char *> GA_ROHandleS;
typedef GA_ROHandleT<float> GA_ROHandleF;
typedef GA_ROHandleT<int> GA_ROHandleI;
typedef GA_ROHandleT<UT_Quaternion> GA_ROHandleQ;
typedef GA_ROHandleT<UT_Vector3> GA_ROHandleV3;

template <class T>
class GA_RWHandleT {
public:
  GA_RWHandleT() = default;
  explicit GA_RWHandleT(const GA_RWAttributeRef &attribute) : detail_(attribute.detail_), name_(attribute.name_) {}
  GA_RWHandleT(GA_Detail *gdp, GA_AttributeOwner owner, const UT_StringRef &name)
      : detail_((owner == GA_ATTRIB_POINT && gdp->fake_geometry().attributes.count(name.c_str())) ||
                        (owner == GA_ATTRIB_VERTEX && gdp->fake_geometry().of_vertices.count(name.c_str()))
                    ? gdp
                    : nullptr),
        owner_(owner),
        name_(name.c_str()) {}
  bool isValid() const { return detail_ != nullptr; }
  T get(GA_Offset offset) const;
  void set(GA_Offset offset, const T &value) const;
  void bumpDataId() const { ++detail_->fake_geometry().bumps[name_]; }

private:
  GU_Detail *detail_ = nullptr;
  GA_AttributeOwner owner_ = GA_ATTRIB_POINT;
  std::string name_;
};
typedef GA_RWHandleT<UT_Vector3> GA_RWHandleV3;

// Patterns of groups: names, wildcards at a name's end, and numbers from-to, as far as the tests write them.
class GOP_Manager {
public:
  class GroupCreator {
  public:
    GroupCreator(const GU_Detail *gdp) : detail_(gdp) {}

  private:
    friend class GOP_Manager;
    const GU_Detail *detail_;
  };
  const GA_PointGroup *parsePointGroups(const char *pattern, const GroupCreator &creator);
  const GA_PointGroup *parsePointGroups(const UT_StringRef &pattern, const GroupCreator &creator) {
    return parsePointGroups(pattern.c_str(), creator);
  }
  const GA_EdgeGroup *parseEdgeGroups(const char *pattern, const GroupCreator &creator, bool strict);  // names alone

private:
  std::vector<std::unique_ptr<GA_PointGroup>> made_;
};

class GU_DetailHandle {
public:
  explicit GU_DetailHandle(GU_Detail *detail) : detail_(detail) {}
  GU_Detail *gdpNC() const { return detail_; }

private:
  GU_Detail *detail_;
};

// ---------------------------------------------------------------------------------------------------------- parameters

class PRM_Name {
public:
  PRM_Name(const char *token = nullptr, const char *label = nullptr, int = 1) : token_(token), label_(label) {}
  const char *getToken() const { return token_; }
  const char *getLabel() const { return label_; }

private:
  const char *token_, *label_;
};

enum PRM_ChoiceListType { PRM_CHOICELIST_SINGLE = 0x1002 };

class PRM_ChoiceList {
public:
  PRM_ChoiceList(PRM_ChoiceListType, PRM_Name *names)
      : names_(names) {}  // ends with a name without token; kept, not copied
  PRM_Name *choiceNamesPtr() { return names_; }

private:
  PRM_Name *names_;
};

class PRM_TemplateBuilder {
public:
  PRM_TemplateBuilder(const UT_StringHolder &name, const char *dstext);
  ~PRM_TemplateBuilder();
  PRM_Template *templates() { return template_.get(); }
  void setChoiceListPtr(const UT_StringRef &name, PRM_ChoiceList *list);
  bool justBuilt() { return !std::exchange(built_, true); }

private:
  std::unique_ptr<PRM_Template> template_;
  bool built_ = false;
};

// --------------------------------------------------------------------------------------------------------------- nodes

enum OP_ERROR { UT_ERROR_NONE, UT_ERROR_MESSAGE, UT_ERROR_WARNING, UT_ERROR_ABORT };
typedef OP_ERROR UT_ErrorSeverity;
enum { SOP_MESSAGE = 1 };

class OP_Context {
public:
  explicit OP_Context(fpreal time) : time_(time) {}
  fpreal getTime() const { return time_; }

private:
  fpreal time_;
};

class CH_LocalVariable;
typedef OP_Node *(*OP_Constructor)(OP_Network *, const char *, OP_Operator *);

class OP_Operator {
public:
  OP_Operator(const char *name, const char *english, OP_Constructor construct, PRM_Template *templates,
              unsigned min_sources, unsigned max_sources = 1, CH_LocalVariable *variables = 0, unsigned flags = 0);
  OP_Operator(const UT_StringHolder &name, const char *english, OP_Constructor construct, PRM_Template *templates,
              unsigned min_sources, unsigned max_sources = 1, CH_LocalVariable *variables = 0, unsigned flags = 0)
      : OP_Operator(name.c_str(), english, construct, templates, min_sources, max_sources, variables, flags) {}
  std::string name;
  OP_Constructor construct;
  PRM_Template *templates;
  unsigned min_sources, max_sources;
};

class OP_OperatorTable {
public:
  bool addOperator(OP_Operator *op) {
    operators.emplace_back(op);
    return true;
  }
  std::vector<std::unique_ptr<OP_Operator>> operators;
};

class OP_Node {
public:
  virtual ~OP_Node();
  int getUniqueId() const { return id_; }

private:
  static int last_id;
  int id_ = ++last_id;
};

class SOP_NodeCache {
public:
  virtual ~SOP_NodeCache();
  virtual int64 getMemoryUsage(bool inclusive) const { return inclusive ? 1 : 0; }
};

class SOP_NodeParms {
public:
  virtual ~SOP_NodeParms();
  // In Houdini the generated class reads its node; here, the evaluated values by name.
  virtual void fake_load(const std::map<std::string, fake::Parm> &values) = 0;
};

namespace fake {
struct Parm {
  std::string type;
  std::vector<std::string> defaults;
  std::vector<double> numbers;
  std::string text;
  PRM_ChoiceList *menu = nullptr;  // given by the builder
  mutable bool read = false;
};
}  // namespace fake

class SOP_NodeVerb {
public:
  virtual ~SOP_NodeVerb();

  template <typename T>
  class Register {
  public:
    Register() : verb_(new T()) {}
    ~Register() { delete verb_; }
    const T *get() const { return verb_; }

  private:
    T *verb_;
  };

  enum CookMode { COOK_INPLACE, COOK_DUPLICATE, COOK_GENERATOR, COOK_INSTANCE, COOK_GENERIC, COOK_PASSTHROUGH };

  class CookParms {
  public:
    CookParms(fake::Cook &cook) : cook_(cook) {}
    GU_DetailHandle &gdh() const;
    const GU_Detail *inputGeo(exint idx) const;
    template <typename T>
    const T &parms() const {
      return dynamic_cast<const T &>(any_parms());
    }
    SOP_NodeCache *cache() const;
    SOP_Node *getNode() const;
    OP_Node *getSrcNode() const;
    UT_ErrorSeverity sopAddWarning(int code, const char *msg = 0, const UT_SourceLocation *loc = 0) const;
    UT_ErrorSeverity sopAddError(int code, const char *msg = 0, const UT_SourceLocation *loc = 0) const;

  private:
    const SOP_NodeParms &any_parms() const;
    fake::Cook &cook_;
  };

  virtual SOP_NodeCache *allocCache() const { return new SOP_NodeCache; }
  virtual SOP_NodeParms *allocParms() const = 0;
  virtual UT_StringHolder name() const = 0;
  virtual CookMode cookMode(const SOP_NodeParms *parms) const = 0;
  virtual void cook(const CookParms &cookparms) const = 0;
};

class SOP_Flags {
public:
  void setManagesDataIDs(bool managed) { manages = managed; }
  bool manages = false;
};

class SOP_Node : public OP_Node {
public:
  SOP_Node(OP_Network *parent, const char *name, OP_Operator *entry);
  ~SOP_Node() override;
  static PRM_ChoiceList pointGroupMenu, pointAttribReplaceMenu, primAttribReplaceMenu, edgeGroupMenu;
  virtual const SOP_NodeVerb *cookVerb() const { return nullptr; }
  virtual const char *inputLabel(unsigned index) const { return index ? "" : "Input"; }

  fake::Cook &fake_cook() { return *cook_; }
  OP_ERROR fake_run(OP_Context &context) { return cookMySop(context); }

protected:
  virtual OP_ERROR cookMySop(OP_Context &context) = 0;
  OP_ERROR cookMyselfAsVerb(OP_Context &context);
  SOP_Flags mySopFlags;

private:
  friend struct fake::Cook;
  std::unique_ptr<fake::Cook> cook_;
};

extern "C" {
__attribute__((visibility("default"))) extern void newSopOperator(OP_OperatorTable *table);
}

// ------------------------------------------------------------------------------------------------------- a tiny network

namespace fake {

// Everything about one node: what goes in, what the last cook left.
struct Cook {
  std::map<std::string, Parm> parms;  // by name; numbers are set by the test, or evaluated from the defaults
  std::set<std::string> set_by_hand;
  double frames_per_second = 24;
  const GU_Detail *inputs[4] = {nullptr, nullptr, nullptr, nullptr};
  GU_Detail output;
  GU_DetailHandle handle{&output};
  std::unique_ptr<SOP_NodeCache> cache;
  std::unique_ptr<SOP_NodeParms> values;
  std::vector<std::string> errors, warnings;
  bool keep_cache = true;
  SOP_Node *node = nullptr;
  bool compiled = false;  // in a compiled block a verb has no node

  void set(const std::string &parm, std::vector<double> numbers);
  void set_text(const std::string &parm, const std::string &text);
  void evaluate(double time);
};

struct Interrupts {
  int polls = 0, at = 0, open = 0;  // at: the poll at which the user presses Esc; 0 = never
  std::vector<std::pair<std::string, int>> shown;  // what the box said at each poll, with its percentage
};
Interrupts &interrupts();

// Loads a plug-in as Houdini does and makes nodes of its one operator.
class Plugin {
public:
  explicit Plugin(const std::string &path);
  ~Plugin();
  Plugin(const Plugin &) = delete;
  Plugin &operator=(const Plugin &) = delete;
  std::unique_ptr<SOP_Node> create() const;
  const OP_Operator &op() const { return *table_.operators.at(0); }

private:
  void *library_ = nullptr;
  OP_OperatorTable table_;
};

}  // namespace fake
