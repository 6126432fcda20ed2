#include "fake_houdini.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <sstream>
#include <stdexcept>

// A parsed dialog script.
class PRM_Template {
public:
  std::map<std::string, fake::Parm> parms;
};

namespace fake {

void Geometry::group(const std::string &name, const std::vector<int> &members) {
  for (const int index : members) groups[name].offsets.insert(offset(index));
}

const double *Geometry::find(GA_AttributeOwner owner, const std::string &name, GA_Offset at, std::size_t width) const {
  return &(owner == GA_ATTRIB_PRIMITIVE ? of_primitives : owner == GA_ATTRIB_VERTEX ? of_vertices : attributes).at(name).at(static_cast<std::size_t>((at - 3) / 2) * width);
}

void Cook::set(const std::string &parm, std::vector<double> numbers) {
  Parm &p = parms.at(parm);
  if (p.type == "string" || numbers.size() != p.numbers.size())
    throw std::runtime_error("wrong kind of value: " + parm);
  p.numbers = std::move(numbers);
  set_by_hand.insert(parm);
}

void Cook::set_text(const std::string &parm, const std::string &text) {
  if (parms.at(parm).type != "string") throw std::runtime_error("no string: " + parm);
  parms.at(parm).text = text;
}

void Cook::evaluate(double time) {
  for (auto &[name, parm] : parms) {
    if (parm.type == "string" || set_by_hand.count(name)) continue;
    for (std::size_t k = 0; k < parm.defaults.size(); ++k) {
      const std::string &text = parm.defaults[k];
      parm.numbers[k] = text == "$T"        ? time
                        : text == "$FPS"    ? frames_per_second
                        : text == "$FSTART" ? 1
                                            : std::strtod(text.c_str(), nullptr);
    }
  }
}

Interrupts &interrupts() {
  static Interrupts only;
  return only;
}

Plugin::Plugin(const std::string &path) {
  library_ = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (!library_) throw std::runtime_error(dlerror());
  const auto start = reinterpret_cast<void (*)(OP_OperatorTable *)>(dlsym(library_, "newSopOperator"));
  if (!start) throw std::runtime_error("no newSopOperator in " + path);
  start(&table_);
}

Plugin::~Plugin() {
  table_.operators.clear();
  dlclose(library_);
}

std::unique_ptr<SOP_Node> Plugin::create() const {
  OP_Operator &made = *table_.operators.at(0);
  std::unique_ptr<SOP_Node> node(static_cast<SOP_Node *>(made.construct(nullptr, "shellwarp1", &made)));
  node->fake_cook().parms = made.templates->parms;
  node->fake_cook().evaluate(0);
  return node;
}

namespace {

// The part of the dialog script's language that a list of parameters uses: words, quoted strings and braces.
std::vector<std::string> words_of(const char *text) {
  std::vector<std::string> words;
  for (const char *at = text; *at;) {
    if (*at == ' ' || *at == '\n') {
      ++at;
    } else if (*at == '"') {
      const char *end = at + 1;
      while (*end && *end != '"') ++end;
      words.emplace_back(at, end + 1);
      at = end + 1;
    } else if (*at == '{' || *at == '}') {
      words.emplace_back(1, *at++);
    } else {
      const char *end = at;
      while (*end && *end != ' ' && *end != '\n' && *end != '}') ++end;
      words.emplace_back(at, end);
      at = end;
    }
  }
  return words;
}

std::string unquoted(const std::string &word) {
  return word.size() >= 2 && word[0] == '"' ? word.substr(1, word.size() - 2) : word;
}

void parse_parm(const std::vector<std::string> &words, std::size_t &at, std::map<std::string, Parm> &parms) {
  Parm parm;
  std::string name;
  std::size_t size = 1;
  for (++at; words.at(at) != "}";) {
    const std::string key = words[at++];
    std::vector<std::string> values;
    if (words.at(at) == "{") {
      for (++at; words.at(at) != "}"; ++at) values.push_back(unquoted(words[at]));
      ++at;
    } else {
      values.push_back(unquoted(words[at++]));
    }
    if (key == "name") name = values[0];
    if (key == "type") parm.type = values[0];
    if (key == "size") size = static_cast<std::size_t>(std::atoi(values[0].c_str()));
    if (key == "default") parm.defaults = values;
  }
  ++at;
  if (name.empty() || parm.type.empty() || parm.defaults.size() != size || parms.count(name))
    throw std::runtime_error("dialog script: parameter " + name);
  if (parm.type == "string") parm.text = parm.defaults[0];
  parm.numbers.assign(size, 0);
  parms[name] = parm;
}

}  // namespace

template <class T>
T read(const double *from);
template <>
float read<float>(const double *from) {
  return static_cast<float>(*from);
}
template <>
int read<int>(const double *from) {
  return static_cast<int>(*from);
}
template <>
UT_Vector3 read<UT_Vector3>(const double *v) {
  return UT_Vector3(float(v[0]), float(v[1]), float(v[2]));
}
template <>
UT_Quaternion read<UT_Quaternion>(const double *q) {
  return UT_Quaternion(float(q[0]), float(q[1]), float(q[2]), float(q[3]));
}

}  // namespace fake

PRM_TemplateBuilder::PRM_TemplateBuilder(const UT_StringHolder &, const char *dstext)
    : template_(std::make_unique<PRM_Template>()) {
  const std::vector<std::string> words = fake::words_of(dstext);
  for (std::size_t at = 3; words.at(at) != "}";) {  // { name parameters
    if (words[at++] != "parm") throw std::runtime_error("dialog script: " + words[at - 1]);
    fake::parse_parm(words, at, template_->parms);
  }
}
PRM_TemplateBuilder::~PRM_TemplateBuilder() = default;
void PRM_TemplateBuilder::setChoiceListPtr(const UT_StringRef &name, PRM_ChoiceList *list) {
  template_->parms.at(name.c_str()).menu = list;
}

// ------------------------------------------------------------------------------------------------------------ geometry

UT_AutoInterrupt::UT_AutoInterrupt(const char *name) : name_(name) { ++fake::interrupts().open; }
UT_AutoInterrupt::~UT_AutoInterrupt() { --fake::interrupts().open; }
bool UT_AutoInterrupt::wasInterrupted() { return wasInterrupted(-1); }
bool UT_AutoInterrupt::wasInterrupted(int percent) {
  fake::interrupts().shown.emplace_back(name_, percent);
  return ++fake::interrupts().polls == fake::interrupts().at;
}

GA_Primitive::~GA_Primitive() = default;
GU_Detail::GU_Detail() : geometry_(std::make_unique<fake::Geometry>()) {}
GU_Detail::~GU_Detail() = default;
GU_Detail::GU_Detail(const GU_Detail &other) : geometry_(std::make_unique<fake::Geometry>(*other.geometry_)) {}
GU_Detail &GU_Detail::operator=(const GU_Detail &other) {
  *geometry_ = *other.geometry_;
  return *this;
}

static GA_Range range_of(std::size_t n) {
  std::vector<GA_Offset> offsets;
  for (std::size_t i = 0; i < n; ++i) offsets.push_back(fake::Geometry::offset(static_cast<GA_Index>(i)));
  return GA_Range(offsets);
}

GA_Size GU_Detail::getNumPoints() const { return static_cast<GA_Size>(geometry_->points.size()); }
GA_Range GU_Detail::getPointRange() const { return range_of(geometry_->points.size()); }
GA_Range GU_Detail::getPrimitiveRange() const { return range_of(geometry_->primitives.size()); }
GA_Index GU_Detail::pointIndex(GA_Offset offset) const { return (offset - 3) / 2; }
GA_Index GU_Detail::primitiveIndex(GA_Offset offset) const { return (offset - 3) / 2; }
const GA_Primitive *GU_Detail::getPrimitive(GA_Offset offset) const {
  const std::size_t at = static_cast<std::size_t>(primitiveIndex(offset));
  const GEO_PrimPoly &found = geometry_->primitives.at(at);
  found.first_vertex = 0;
  for (std::size_t k = 0; k < at; ++k) found.first_vertex += geometry_->primitives[k].getVertexCount();
  return &found;
}
UT_Vector3 GU_Detail::getPos3(GA_Offset offset) const {
  return geometry_->points.at(static_cast<std::size_t>(pointIndex(offset)));
}
void GU_Detail::setPos3(GA_Offset offset, const UT_Vector3 &position) {
  geometry_->points.at(static_cast<std::size_t>(pointIndex(offset))) = position;
}
GA_Attribute *GU_Detail::getP() { return &geometry_->position; }
GA_RWAttributeRef GU_Detail::findFloatTuple(GA_AttributeOwner owner, const UT_StringRef &name, int, int) {
  GA_RWAttributeRef found;
  if (owner == GA_ATTRIB_POINT && geometry_->attributes.count(name.c_str())) found.detail_ = this;
  found.name_ = name.c_str();
  return found;
}
GA_RWAttributeRef GU_Detail::addFloatTuple(GA_AttributeOwner, const UT_StringHolder &name, int size) {
  geometry_->attributes[name.c_str()].assign(geometry_->points.size() * static_cast<std::size_t>(size), 0);
  GA_RWAttributeRef made;
  made.detail_ = this;
  made.name_ = name.c_str();
  return made;
}
void GA_RWAttributeRef::setTypeInfo(GA_TypeInfo type) const {
  if (type == GA_TYPE_VECTOR) detail_->fake_geometry().vectors.insert(name_);
}

const GA_PointGroup *GOP_Manager::parsePointGroups(const char *pattern, const GroupCreator &creator) {
  made_.push_back(std::make_unique<GA_PointGroup>());
  GA_PointGroup &out = *made_.back();
  std::istringstream words(pattern);
  for (std::string word; words >> word;) {
    if (word[0] >= '0' && word[0] <= '9') {
      const long from = std::atol(word.c_str());
      const long to = word.find('-') == std::string::npos ? from : std::atol(word.c_str() + word.find('-') + 1);
      for (long k = from; k <= to; ++k) out.offsets.insert(fake::Geometry::offset(k));
      continue;
    }
    bool any = false;
    const bool open = word.back() == '*';
    for (const auto &[name, group] : creator.detail_->fake_geometry().groups)
      if (open ? name.rfind(word.substr(0, word.size() - 1), 0) == 0 : name == word) {
        out.offsets.insert(group.offsets.begin(), group.offsets.end());
        any = true;
      }
    if (!any) return nullptr;
  }
  return &out;
}

const GA_EdgeGroup *GOP_Manager::parseEdgeGroups(const char *pattern, const GroupCreator &creator, bool) {
  const auto &groups = creator.detail_->fake_geometry().edge_groups;
  const auto found = groups.find(pattern);
  return found == groups.end() ? nullptr : &found->second;
}

template <class T>
T GA_ROHandleT<T>::get(GA_Offset offset) const {
  return fake::read<T>(detail_->fake_geometry().find(owner_, name_, offset, sizeof(T) / sizeof(float)));
}
template <>
UT_Vector3 GA_RWHandleV3::get(GA_Offset offset) const {
  const double *v = detail_->fake_geometry().find(owner_, name_, offset, 3);
  return UT_Vector3(float(v[0]), float(v[1]), float(v[2]));
}
template <>
void GA_RWHandleV3::set(GA_Offset offset, const UT_Vector3 &value) const {
  double *to = const_cast<double *>(detail_->fake_geometry().find(owner_, name_, offset, 3));
  to[0] = value.x(), to[1] = value.y(), to[2] = value.z();
}
template class GA_ROHandleT<float>;
template class GA_ROHandleT<int>;
template class GA_ROHandleT<UT_Quaternion>;
template class GA_ROHandleT<UT_Vector3>;

// --------------------------------------------------------------------------------------------------------------- nodes

OP_Operator::OP_Operator(const char *type, const char *, OP_Constructor constructor, PRM_Template *parms,
                         unsigned least, unsigned most, CH_LocalVariable *, unsigned)
    : name(type), construct(constructor), templates(parms), min_sources(least), max_sources(most) {}

int OP_Node::last_id = 0;
OP_Node::~OP_Node() = default;
SOP_NodeCache::~SOP_NodeCache() = default;
SOP_NodeParms::~SOP_NodeParms() = default;
SOP_NodeVerb::~SOP_NodeVerb() = default;
static PRM_Name no_names[1];
PRM_ChoiceList SOP_Node::pointGroupMenu(PRM_CHOICELIST_SINGLE, no_names);
PRM_ChoiceList SOP_Node::pointAttribReplaceMenu(PRM_CHOICELIST_SINGLE, no_names);
PRM_ChoiceList SOP_Node::primAttribReplaceMenu(PRM_CHOICELIST_SINGLE, no_names);
PRM_ChoiceList SOP_Node::edgeGroupMenu(PRM_CHOICELIST_SINGLE, no_names);
SOP_Node::SOP_Node(OP_Network *, const char *, OP_Operator *) : cook_(std::make_unique<fake::Cook>()) {
  cook_->node = this;
}
SOP_Node::~SOP_Node() = default;

OP_ERROR SOP_Node::cookMyselfAsVerb(OP_Context &context) {
  const SOP_NodeVerb *verb = cookVerb();
  fake::Cook &cook = *cook_;
  cook.errors.clear();
  cook.warnings.clear();
  cook.evaluate(context.getTime());
  cook.values.reset(verb->allocParms());
  cook.values->fake_load(cook.parms);
  for (const auto &[name, parm] : cook.parms)
    if (!parm.read) throw std::runtime_error("never read: " + name);
  if (verb->cookMode(cook.values.get()) != SOP_NodeVerb::COOK_INPLACE || !mySopFlags.manages)
    throw std::runtime_error("the stand-in knows nodes that cook in place and manage their data ids");
  if (!cook.keep_cache || !cook.cache) cook.cache.reset(verb->allocCache());
  cook.output = *cook.inputs[0];
  cook.output.getP()->bumps = 0;
  verb->cook(SOP_NodeVerb::CookParms(cook));
  return !cook.errors.empty() ? UT_ERROR_ABORT : !cook.warnings.empty() ? UT_ERROR_WARNING : UT_ERROR_NONE;
}

GU_DetailHandle &SOP_NodeVerb::CookParms::gdh() const { return cook_.handle; }
// In place: the first input is the destination by now.
const GU_Detail *SOP_NodeVerb::CookParms::inputGeo(exint idx) const {
  return idx >= 1 && idx <= 3 ? cook_.inputs[idx] : nullptr;
}
SOP_Node *SOP_NodeVerb::CookParms::getNode() const { return cook_.compiled ? nullptr : cook_.node; }
OP_Node *SOP_NodeVerb::CookParms::getSrcNode() const { return cook_.node; }
SOP_NodeCache *SOP_NodeVerb::CookParms::cache() const { return cook_.cache.get(); }
const SOP_NodeParms &SOP_NodeVerb::CookParms::any_parms() const { return *cook_.values; }
UT_ErrorSeverity SOP_NodeVerb::CookParms::sopAddWarning(int, const char *msg, const UT_SourceLocation *) const {
  cook_.warnings.push_back(msg);
  return UT_ERROR_WARNING;
}
UT_ErrorSeverity SOP_NodeVerb::CookParms::sopAddError(int, const char *msg, const UT_SourceLocation *) const {
  cook_.errors.push_back(msg);
  return UT_ERROR_ABORT;
}
