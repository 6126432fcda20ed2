#include "SOP_ShellWarp.hpp"

// Written from theDsFile below by Houdini's own generator: SOP_ShellWarpParms, with an accessor for each parameter.
#include "SOP_ShellWarp.proto.h"

#include "blend.hpp"
#include "hash.hpp"
#include "message.hpp"
#include "phase.hpp"
#include "pull.hpp"
#include "runner_store.hpp"

#include <GU/GU_Detail.h>
#include <OP/OP_Operator.h>
#include <OP/OP_OperatorTable.h>
#include <PRM/PRM_ChoiceList.h>
#include <PRM/PRM_Include.h>
#include <PRM/PRM_Name.h>
#include <PRM/PRM_TemplateBuilder.h>
#include <SOP/SOP_NodeVerb.h>
#include <UT/UT_DSOVersion.h>
#include <UT/UT_Interrupt.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

const UT_StringHolder SOP_ShellWarp::theSOPTypeName("shellwarp");

void newSopOperator(OP_OperatorTable *table) {
  table->addOperator(new OP_Operator(SOP_ShellWarp::theSOPTypeName, "Shell Warp", SOP_ShellWarp::myConstructor,
                                     SOP_ShellWarp::buildTemplates(), 1, 4, nullptr, 0));
}

static const char *theDsFile = R"THEDSFILE(
{
    name parameters
    parm { name "time" label "Time" type float default { "$T" } }
    parm { name "startframe" label "Start Frame" type float default { "$FSTART" } }
    parm { name "framerate" label "Frames per Second" type float default { "$FPS" } range { 1 120 } }
    parm { name "gravity" label "Gravity" type vector size 3 default { "0" "-9.81" "0" } }
    parm { name "wind" label "Wind" type vector size 3 default { "0" "0" "0" } }
    parm { name "airdensity" label "Air Density" type float default { "0" } range { 0! 2 } }
    parm { name "normaldrag" label "Normal Drag" type float default { "1.5" } range { 0! 2 } }
    parm { name "tangentialdrag" label "Tangential Drag" type float default { "0.05" } range { 0! 1 } }
    parm { name "windattrib" label "Wind Attribute" type string default { "" } }
    parm { name "force" label "Force Attribute" type string default { "" } }
    parm {
        name "stiffnessfrom" label "Stiffness From" type ordinal default { "0" }
        menu { "frequency" "Frequency" "material" "Material" "preset" "Known Material" "sheet" "Sheet" "sag" "Sag" }
    }
    parm { name "frequency" label "Frequency" type float default { "2" } range { 0 10 } hidewhen "{ stiffnessfrom != frequency }" }
    parm { name "sag" label "Sag" type float default { "0.1" } range { 0 1 } hidewhen "{ stiffnessfrom != sag }" }
    parm { name "thickness" label "Thickness" type float default { "0" } range { 0! 1 } hidewhen "{ stiffnessfrom == material }" }
    parm { name "preset" label "Known Material" type string default { "card" } hidewhen "{ stiffnessfrom != preset }" }
    parm { name "young" label "Young's Modulus" type float default { "3e9" } range { 0! 100000000000 } hidewhen "{ stiffnessfrom != sheet }" }
    parm { name "poisson" label "Poisson's Ratio" type float default { "0.3" } range { -0.99! 0.5! } hidewhen "{ stiffnessfrom != sheet }" }
    parm { name "volumedensity" label "Density by Volume" type float default { "1000" } range { 0! 10000 } hidewhen "{ stiffnessfrom != sheet }" }
    parm { name "thicknessmap" label "Thickness Map" type string default { "" } hidewhen "{ stiffnessfrom == frequency } { stiffnessfrom == material } { stiffnessfrom == sag }" }
    parm { name "youngmap" label "Young's Modulus Map" type string default { "" } hidewhen "{ stiffnessfrom == frequency } { stiffnessfrom == material } { stiffnessfrom == sag }" }
    parm { name "densitymap" label "Density Map" type string default { "" } }
    parm { name "youngacross" label "Young's Modulus Across" type float default { "0" } range { 0! 100000000000 } hidewhen "{ stiffnessfrom == frequency } { stiffnessfrom == material } { stiffnessfrom == sag }" }
    parm { name "shear" label "Shear Modulus" type float default { "0" } range { 0! 100000000000 } hidewhen "{ stiffnessfrom == frequency } { stiffnessfrom == material } { stiffnessfrom == sag }" }
    parm { name "direction" label "Direction" type vector size 3 default { "1" "0" "0" } hidewhen "{ stiffnessfrom == frequency } { stiffnessfrom == material } { stiffnessfrom == sag }" }
    parm { name "directions" label "Direction Attribute" type string default { "" } hidewhen "{ stiffnessfrom == frequency } { stiffnessfrom == material } { stiffnessfrom == sag }" }
    parm { name "metresperunit" label "Metres per Unit" type float default { "1" } range { 0! 1 } hidewhen "{ stiffnessfrom == material }" }
    parm { name "kbend" label "Bend Stiffness" type float default { "1" } range { 0 100 } hidewhen "{ stiffnessfrom != material }" }
    parm { name "kstretch" label "Stretch Stiffness" type float default { "10000" } range { 0 1000000 } hidewhen "{ stiffnessfrom != material }" }
    parm { name "density" label "Density" type float default { "1" } range { 0 10 } hidewhen "{ stiffnessfrom != material }" }
    parm { name "bendmap" label "Bending Map" type string default { "" } hidewhen "{ stiffnessfrom != material }" }
    parm { name "stretchmap" label "Stretch Map" type string default { "" } hidewhen "{ stiffnessfrom != material }" }
    parm { name "growthmap" label "Growth Map" type string default { "" } }
    parm { name "restshape" label "Rest Shape" type string default { "" } }
    parm { name "creasegroup" label "Crease Group" type string default { "" } }
    parm { name "creasefactor" label "Crease Factor" type float default { "0.1" } range { 0! 10 } }
    parm { name "creasesetsangle" label "Crease Sets Angle" type toggle default { "0" } }
    parm { name "creaseangle" label "Crease Angle" type float default { "0" } range { -180! 180! } }
    parm { name "creaseyield" label "Crease Yield" type float default { "0" } range { 0! 180 } }
    parm { name "dampingratio" label "Damping Ratio" type float default { "0.05" } range { 0! 1 } }
    parm { name "dampingmass" label "Mass Damping" type float default { "0" } range { 0! 10 } }
    parm { name "dampingstiffness" label "Stiffness Damping" type float default { "0" } range { 0! 1 } }
    parm { name "dampingmap" label "Damping Map" type string default { "" } }
    parm { name "stiffnessfactor" label "Stiffness Factor" type float default { "1" } range { 0! 10 } }
    parm { name "modes" label "Modes" type integer default { "16" } range { 1! 64 } }
    parm { name "doubleprecision" label "Double Precision" type toggle default { "0" } }
    parm { name "method" label "Method" type string default { "auto" } }
    parm { name "reducedfields" label "Reduced Fields" type integer default { "40" } range { 1! 100 } }
    parm { name "autoerror" label "Automatic Error" type float default { "0" } range { 0! 1 } }
    parm { name "correctionsteps" label "Correction Steps" type integer default { "0" } range { 0! 10 } }
    parm {
        name "integrator" label "Integrator" type ordinal default { "0" }
        menu { "exact" "Exact" "impliciteuler" "Implicit Euler" }
    }
    parm { name "certify" label "Certify" type toggle default { "0" } }
    parm { name "supportkind" label "Supports" type ordinal default { "0" } menu { "clamped" "Clamped" "hinged" "Hinged" } }
    parm { name "supportgroup" label "Support Group" type string default { "" } }
    parm { name "supportattrib" label "Support Attribute" type string default { "" } }
    parm { name "supportaxes" label "Support Axes Attribute" type string default { "" } }
    parm { name "tieto" label "Tie to Point Attribute" type string default { "" } }
    parm { name "tietoface" label "Tie to Primitive Attribute" type string default { "" } }
    parm { name "tiestiffness" label "Tie Stiffness" type float default { "0" } range { 0! 10000 } }
    parm { name "tiewithin" label "Tie Within" type float default { "0" } range { 0! 1 } }
    parm { name "follow" label "Supports Follow" type toggle default { "1" } }
    parm { name "followrest" label "Rest Shape Follows" type toggle default { "0" } }
    parm { name "supportfields" label "Support Fields" type integer default { "24" } range { 0! 64 } }
    parm { name "proxyvertices" label "Proxy Points" type integer default { "0" } range { 0! 5000 } }
    parm { name "proxythickness" label "Proxy Thickness" type float default { "0" } range { 0! 1 } }
    parm { name "framet" label "Support Frame Translate" type vector size 3 default { "0" "0" "0" } }
    parm { name "framer" label "Support Frame Rotate" type vector size 3 default { "0" "0" "0" } }
    parm {
        name "collidershape" label "Collider Shape" type ordinal default { "5" }
        menu { "plane" "Plane" "sphere" "Sphere" "capsule" "Capsule" "box" "Box" "hull" "Hull" "mesh" "Mesh" "deforming" "Deforming Mesh" }
    }
    parm { name "collidercells" label "Collider Cells" type integer default { "64" } range { 4! 2000! } }
    parm { name "colliderfriction" label "Collider Friction" type float default { "0.3" } range { 0! 1 } }
    parm { name "colliderthickness" label "Collider Thickness" type float default { "0" } range { 0! 1 } }
    parm { name "collideronesided" label "Collider One-Sided" type toggle default { "0" } }
    parm { name "colliderdepth" label "Collider Depth" type float default { "0" } range { 0! 1 } }
    parm { name "collidert" label "Collider Translate" type vector size 3 default { "0" "0" "0" } }
    parm { name "colliderr" label "Collider Rotate" type vector size 3 default { "0" "0" "0" } }
    parm { name "colliderpieces" label "Collider Pieces" type string default { "" } }
    parm { name "contactpatches" label "Contact Patches" type string default { "" } }
    parm { name "contactpatchesnear" label "Contact Patches Near" type float default { "0" } range { 0! 1 } }
    parm { name "contactpatchesmost" label "Contact Patches Most" type integer default { "16" } range { 1! 128! } }
    parm { name "pushout" label "Push Out" type toggle default { "0" } }
    parm { name "envelope" label "Envelope" type float default { "1" } range { 0 1 } }
    parm { name "velocity" label "Velocity for Motion Blur" type toggle default { "0" } }
    parm { name "weightattrib" label "Weight Attribute" type string default { "" } }
}
)THEDSFILE";

// The library's table as a menu. What is kept in the scene is the name, which is for good: scenes survive a table that grows.
static PRM_ChoiceList &method_menu() {
  static std::vector<PRM_Name> names;  // it and the list live as long as the operator
  for (const uint32_t method : host::methods()) names.emplace_back(sw_method_name(method), sw_method_label(method));
  names.emplace_back();  // ends the list
  static PRM_ChoiceList menu(PRM_CHOICELIST_SINGLE, names.data());
  return menu;
}

static PRM_ChoiceList &preset_menu() {
  static std::vector<PRM_Name> names;
  for (uint32_t k = 0; k < sw_preset_count(); ++k) names.emplace_back(sw_preset_name(k), sw_preset_label(k));
  names.emplace_back();
  static PRM_ChoiceList menu(PRM_CHOICELIST_SINGLE, names.data());
  return menu;
}

PRM_Template *SOP_ShellWarp::buildTemplates() {
  static PRM_TemplateBuilder builder("SOP_ShellWarp.cpp", theDsFile);
  if (builder.justBuilt()) {
    builder.setChoiceListPtr("method", &method_menu());
    builder.setChoiceListPtr("preset", &preset_menu());
    for (const char *group : {"supportgroup", "contactpatches"}) builder.setChoiceListPtr(group, &SOP_Node::pointGroupMenu);
    builder.setChoiceListPtr("creasegroup", &SOP_Node::edgeGroupMenu);
    builder.setChoiceListPtr("colliderpieces", &SOP_Node::primAttribReplaceMenu);
    for (const char *attribute : {"supportattrib", "weightattrib", "thicknessmap", "youngmap", "densitymap", "bendmap", "stretchmap", "growthmap", "dampingmap", "restshape", "supportaxes", "tieto", "tietoface", "force", "windattrib"})
      builder.setChoiceListPtr(attribute, &SOP_Node::pointAttribReplaceMenu);
  }
  return builder.templates();
}

OP_Node *SOP_ShellWarp::myConstructor(OP_Network *network, const char *name, OP_Operator *op) {
  return new SOP_ShellWarp(network, name, op);
}

SOP_ShellWarp::SOP_ShellWarp(OP_Network *network, const char *name, OP_Operator *op) : SOP_Node(network, name, op) {
  mySopFlags.setManagesDataIDs(true);
}

const char *SOP_ShellWarp::inputLabel(unsigned index) const {
  static const char *const labels[] = {"Polygons to deform", "Points that hold or lead them",
                                       "Polygons that they touch",
                                       "Polygons to simulate in their place"};
  return index < 4 ? labels[index] : "";
}

namespace {

// Shells whose node's cache Houdini has dropped, or whose turn in a loop is over. It is never destroyed: caches may end after all else.
host::RunnerStore &store() {
  static host::RunnerStore *shells = new host::RunnerStore;
  return *shells;
}

// The shell of one node. Houdini says that it may, or may not, keep it from cook to cook: what is dropped goes to the store.
class ShellWarpCache : public SOP_NodeCache {
public:
  ~ShellWarpCache() override {
    if (runner_ && key_) store().keep(key_, std::move(runner_));
  }

  // The shell to go on with: the node's. In a compiled loop one cache meets many pieces: there each piece has a shell by its own points.
  host::ShellRunner &runner(const host::Request &request, const SOP_NodeVerb::CookParms &cookparms) {
    const OP_Node *node = cookparms.getSrcNode();
    const bool compiled = cookparms.getNode() == nullptr;
    const int64_t id = node ? node->getUniqueId() : 0;
    const uint64_t key = compiled ? host::identity(request, id) : host::Hash().add(id).value();
    if (runner_ && compiled && key != key_) store().keep(key_, std::move(runner_));
    if (!runner_) runner_ = store().take(key);
    if (!runner_) runner_ = std::make_unique<host::ShellRunner>();
    key_ = key;
    return *runner_;
  }

  int64 getMemoryUsage(bool inclusive) const override {
    return static_cast<int64>((inclusive ? sizeof(*this) : 0) + (runner_ ? runner_->bytes() : 0));
  }

private:
  std::unique_ptr<host::ShellRunner> runner_;
  uint64_t key_ = 0;  // of the input at the last cook
};

// Houdini's box with the Esc button: what the node does, and of a precompute its phase with how far that is.
class InterruptBox {
public:
  bool interrupted() { return phase_ ? phase_->wasInterrupted(percent_) : all_.wasInterrupted(); }

  void show(uint32_t phase, double fraction) {
    percent_ = static_cast<int>(100 * fraction);
    if (phase_ && phase == number_) return;
    number_ = phase;
    name_ = std::string("Shell Warp: ") + host::phase_name(phase);
    phase_.reset();  // before the next: they are nested
    phase_.emplace(name_.c_str());
  }

private:
  UT_AutoInterrupt all_{"Building and stepping the shell"};
  std::string name_;
  std::optional<UT_AutoInterrupt> phase_;
  uint32_t number_ = 0;
  int percent_ = 0;
};

class ShellWarpVerb : public SOP_NodeVerb {
public:
  SOP_NodeParms *allocParms() const override { return new SOP_ShellWarpParms(); }
  SOP_NodeCache *allocCache() const override { return new ShellWarpCache(); }
  UT_StringHolder name() const override { return SOP_ShellWarp::theSOPTypeName; }
  CookMode cookMode(const SOP_NodeParms *) const override { return COOK_INPLACE; }
  void cook(const CookParms &cookparms) const override;

  static const SOP_NodeVerb::Register<ShellWarpVerb> theVerb;
};

const SOP_NodeVerb::Register<ShellWarpVerb> ShellWarpVerb::theVerb;

uint32_t count_of(int64_t value) { return value > 0 ? static_cast<uint32_t>(value) : 0; }

uint32_t method_of(const UT_StringHolder &name) {
  if (const std::optional<uint32_t> method = host::find_method(name.c_str())) return *method;
  std::string names;
  for (const std::string &known : host::method_names()) names += (names.empty() ? "" : ", ") + known;
  throw host::HostError(std::string("there is no method '") + name.c_str() + "'; there are " + names);
}

uint32_t preset_of(const UT_StringHolder &name) {
  std::string names;
  for (uint32_t k = 0; k < sw_preset_count(); ++k) {
    const std::string known = sw_preset_name(k);
    if (known == name.c_str()) return k;
    names += (names.empty() ? "" : ", ") + known;
  }
  throw host::HostError(std::string("there is no known material '") + name.c_str() + "'; there are " + names);
}

// How stiff, in the words of the five choices.
void pull_stiffness(const SOP_ShellWarpParms &parms, host::Stiffness &stiffness) {
  stiffness.by = static_cast<host::Stiffness::By>(static_cast<int>(parms.getStiffnessfrom()));
  stiffness.frequency = parms.getFrequency();
  stiffness.sag = parms.getSag();
  stiffness.thickness = parms.getThickness();
  stiffness.bend = parms.getKbend();
  stiffness.stretch = parms.getKstretch();
  stiffness.density = parms.getDensity();
  stiffness.young = parms.getYoung();
  stiffness.poisson = parms.getPoisson();
  stiffness.volume_density = parms.getVolumedensity();
  stiffness.metres = parms.getMetresperunit();
  stiffness.young_across = parms.getYoungacross();
  stiffness.shear = parms.getShear();
  const UT_Vector3D along = parms.getDirection();
  stiffness.directions = {along.x(), along.y(), along.z()};
  if (stiffness.by == host::Stiffness::By::preset) stiffness.preset = preset_of(parms.getPreset());
}

// As the parameters have them, one of each piece; what a piece has itself goes over them.
std::vector<host::Collider> colliders_of(const SOP_ShellWarpParms &parms, const GU_Detail &polygons) {
  host::Collider collider;
  collider.name = "the collider";
  collider.kind = static_cast<uint32_t>(static_cast<int>(parms.getCollidershape()) + SW_COLLIDER_PLANE);
  collider.cells = count_of(parms.getCollidercells());
  collider.friction = parms.getColliderfriction();
  collider.thickness = parms.getColliderthickness();
  collider.one_sided = parms.getCollideronesided();
  collider.depth = parms.getColliderdepth();
  const UT_Vector3D t = parms.getCollidert(), r = parms.getColliderr();
  collider.pose = host::pose_of_angles({t.x(), t.y(), t.z()}, {r.x(), r.y(), r.z()});
  return pull_colliders(polygons, parms.getColliderpieces(), collider);
}

void pull_settings(const SOP_ShellWarpParms &parms, host::Request &request) {
  host::Motion &motion = request.motion;
  request.time = parms.getTime();
  motion.frame_rate = parms.getFramerate();
  // Frame 1 is at time 0.
  motion.start_time = motion.frame_rate > 0 ? (parms.getStartframe() - 1) / motion.frame_rate : 0;
  motion.implicit_euler = static_cast<int>(parms.getIntegrator()) == 1;
  motion.damping_ratio = parms.getDampingratio();
  motion.damping_mass = parms.getDampingmass();
  motion.damping_stiffness = parms.getDampingstiffness();

  host::Build &build = request.build;
  build.clamped = static_cast<int>(parms.getSupportkind()) == 0;
  build.support_fields = count_of(parms.getSupportfields());
  request.follow = parms.getFollow();
  request.follow_rest = parms.getFollowrest();
  request.proxy.vertices = count_of(parms.getProxyvertices());
  request.proxy.thickness = parms.getProxythickness();
  build.modes = count_of(parms.getModes());
  build.method = method_of(parms.getMethod());
  build.reduced_fields = count_of(parms.getReducedfields());
  build.auto_error = parms.getAutoerror();
  build.double_precision = parms.getDoubleprecision();
  request.correction_steps = count_of(parms.getCorrectionsteps());
  request.push_out = parms.getPushout();
  request.certify = parms.getCertify();
  request.velocities = parms.getVelocity();
  pull_stiffness(parms, build.stiffness);

  const UT_Vector3D gravity = parms.getGravity(), t = parms.getFramet(), r = parms.getFramer();
  request.inputs.stiffness_factor = parms.getStiffnessfactor();
  request.inputs.gravity = {gravity.x(), gravity.y(), gravity.z()};
  const UT_Vector3D wind = parms.getWind();
  request.inputs.wind = {{wind.x(), wind.y(), wind.z()}, parms.getAirdensity(), parms.getNormaldrag(), parms.getTangentialdrag()};
  request.inputs.frame = host::pose_of_angles({t.x(), t.y(), t.z()}, {r.x(), r.y(), r.z()});
  request.inputs.object = request.inputs.frame;
}

// The attribute is in the geometry's axes.
std::vector<double> to_world(const GU_Detail &detail, const UT_StringHolder &attribute, const host::Pose &object) {
  std::vector<double> vectors = pull_vectors(detail, attribute);
  const host::Pose turn = {{}, object.rotation, 1};
  for (std::size_t i = 0; i < vectors.size(); i += 3) {
    const host::Vec3 f = host::apply(turn, {vectors[i], vectors[i + 1], vectors[i + 2]});
    std::copy(f.begin(), f.end(), &vectors[i]);
  }
  return vectors;
}

void pull_creases(const SOP_ShellWarpParms &parms, const GU_Detail &detail, std::vector<host::Crease> &creases) {
  host::Crease crease;
  crease.factor = parms.getCreasefactor();
  if (parms.getCreasesetsangle()) crease.angle = parms.getCreaseangle();
  crease.yield = parms.getCreaseyield();
  pull_edges(detail, parms.getCreasegroup(), crease, creases);
}

// The first input, or polygons of the fourth in its place, which it then follows.
void pull_shell(const SOP_NodeVerb::CookParms &cookparms, const GU_Detail &detail, host::Request &request) {
  const GU_Detail *simulated = cookparms.inputGeo(3);
  if (!simulated || simulated->getNumPoints() == 0) {
    pull_mesh(detail, request.mesh);
    return;
  }
  request.drawn = points_of(detail);
  try {
    pull_mesh(*simulated, request.mesh);
  } catch (const host::HostError &error) {
    throw host::HostError(std::string("the fourth input: ") + error.what());
  }
}

void ShellWarpVerb::cook(const CookParms &cookparms) const {
  const auto &parms = cookparms.parms<SOP_ShellWarpParms>();
  GU_Detail *detail = cookparms.gdh().gdpNC();
  if (parms.getEnvelope() == 0) return;

  ShellWarpCache passing;  // where Houdini keeps none
  auto *kept = static_cast<ShellWarpCache *>(cookparms.cache());
  try {
    InterruptBox box;
    host::Request request;
    request.interrupted = [&box] { return box.interrupted(); };
    request.progress = [&box](uint32_t phase, double fraction) { box.show(phase, fraction); };
    pull_settings(parms, request);
    pull_shell(cookparms, *detail, request);
    host::Stiffness &stiffness = request.build.stiffness;
    pull_map(*detail, parms.getDensitymap(), stiffness.density_map);
    pull_map(*detail, parms.getGrowthmap(), stiffness.growth_map);
    if (stiffness.by_sheet()) {
      pull_map(*detail, parms.getThicknessmap(), stiffness.thickness_map);
      pull_map(*detail, parms.getYoungmap(), stiffness.young_map);
      if (stiffness.young_across > 0 && parms.getDirections().isstring()) pull_directions(*detail, parms.getDirections(), stiffness);
    } else if (stiffness.by == host::Stiffness::By::material) {
      pull_map(*detail, parms.getBendmap(), stiffness.bend_map);
      pull_map(*detail, parms.getStretchmap(), stiffness.stretch_map);
    }
    if (parms.getForce().isstring()) request.inputs.forces = to_world(*detail, parms.getForce(), request.inputs.object);
    if (parms.getWindattrib().isstring()) request.inputs.wind.local = to_world(*detail, parms.getWindattrib(), request.inputs.object);
    pull_map(*detail, parms.getDampingmap(), request.motion.damping_map);
    if (parms.getRestshape().isstring()) request.build.rest_shape = pull_vectors(*detail, parms.getRestshape());
    pull_creases(parms, *detail, request.build.creases);
    pull_supports(*detail, parms.getSupportgroup(), parms.getSupportattrib(), request.build.held);
    pull_axes(*detail, parms.getSupportaxes(), request.build.axis_supports);
    for (const bool to_face : {false, true})
      pull_ties(*detail, to_face ? parms.getTietoface() : parms.getTieto(), to_face, parms.getTiestiffness(), request.build.ties);
    request.build.tie_within = parms.getTiewithin();
    pull_group(*detail, parms.getContactpatches(), request.build.contact_patches);
    request.build.patches_near = parms.getContactpatchesnear();
    request.build.most_patches = count_of(parms.getContactpatchesmost());
    if (const GU_Detail *points = cookparms.inputGeo(1)) pull_handles(*points, request.inputs.handles);
    const GU_Detail *touched = cookparms.inputGeo(2);
    if (touched && touched->getNumPoints() > 0) request.inputs.colliders = colliders_of(parms, *touched);
    host::ShellRunner &runner = (kept ? *kept : passing).runner(request, cookparms);
    runner.evaluate(std::move(request));
    push(*detail, runner, parms.getEnvelope(), parms.getWeightattrib());
    push_normals(*detail);
    const std::string warning = runner.notes().warning();
    if (!warning.empty()) cookparms.sopAddWarning(SOP_MESSAGE, warning.c_str());
  } catch (const std::exception &error) {
    cookparms.sopAddError(SOP_MESSAGE, error.what());
  } catch (...) {
    cookparms.sopAddError(SOP_MESSAGE, "an unknown error");
  }
}

}  // namespace

const SOP_NodeVerb *SOP_ShellWarp::cookVerb() const { return ShellWarpVerb::theVerb.get(); }
