// The attributes of shellWarp: created, added, and each declared to affect the output.
#include "attribute_makers.hpp"
#include "shell_warp_node.hpp"

#include <maya/MFnCompoundAttribute.h>
#include <maya/MFnEnumAttribute.h>
#include <maya/MFnNumericAttribute.h>
#include <maya/MFnTypedAttribute.h>
#include <maya/MFnUnitAttribute.h>
#include <maya/MGlobal.h>

MObject ShellWarpNode::time, ShellWarpNode::startFrame, ShellWarpNode::cache;
MObject ShellWarpNode::gravity, ShellWarpNode::gravityX, ShellWarpNode::gravityY, ShellWarpNode::gravityZ;
MObject ShellWarpNode::wind, ShellWarpNode::windX, ShellWarpNode::windY, ShellWarpNode::windZ, ShellWarpNode::airDensity,
    ShellWarpNode::normalDrag, ShellWarpNode::tangentialDrag;
MObject ShellWarpNode::force, ShellWarpNode::forceX, ShellWarpNode::forceY, ShellWarpNode::forceZ, ShellWarpNode::forceMapList,
    ShellWarpNode::forceMap, ShellWarpNode::windMapList, ShellWarpNode::windMap;
MObject ShellWarpNode::stiffnessFrom, ShellWarpNode::frequency, ShellWarpNode::sag, ShellWarpNode::thickness, ShellWarpNode::kBend,
    ShellWarpNode::kStretch, ShellWarpNode::density;
MObject ShellWarpNode::preset, ShellWarpNode::young, ShellWarpNode::poisson, ShellWarpNode::volumeDensity;
MObject ShellWarpNode::thicknessMapList, ShellWarpNode::thicknessMap, ShellWarpNode::youngMapList, ShellWarpNode::youngMap,
    ShellWarpNode::densityMapList, ShellWarpNode::densityMap;
MObject ShellWarpNode::bendMapList, ShellWarpNode::bendMap, ShellWarpNode::stretchMapList, ShellWarpNode::stretchMap,
    ShellWarpNode::growthMapList, ShellWarpNode::growthMap;
MObject ShellWarpNode::youngAcross, ShellWarpNode::shear, ShellWarpNode::direction, ShellWarpNode::directionX, ShellWarpNode::directionY,
    ShellWarpNode::directionZ, ShellWarpNode::directions;
MObject ShellWarpNode::creases, ShellWarpNode::creaseEdges, ShellWarpNode::creaseFactor, ShellWarpNode::creaseAngle, ShellWarpNode::creaseSetsAngle, ShellWarpNode::creaseYield,
    ShellWarpNode::restShape;
MObject ShellWarpNode::dampingRatio, ShellWarpNode::dampingMass, ShellWarpNode::dampingStiffness, ShellWarpNode::dampingMapList,
    ShellWarpNode::dampingMap, ShellWarpNode::stiffnessFactor;
MObject ShellWarpNode::method, ShellWarpNode::reducedFields, ShellWarpNode::autoError, ShellWarpNode::correctionSteps,
    ShellWarpNode::integrator;
MObject ShellWarpNode::modes, ShellWarpNode::doublePrecision, ShellWarpNode::certify;
MObject ShellWarpNode::supportKind, ShellWarpNode::supportComponents, ShellWarpNode::supportWeightList,
    ShellWarpNode::supportWeights, ShellWarpNode::follow, ShellWarpNode::followRest, ShellWarpNode::supportFields;
MObject ShellWarpNode::supportAxes, ShellWarpNode::supportAxesComponents, ShellWarpNode::supportAxisX, ShellWarpNode::supportAxisY,
    ShellWarpNode::supportAxisZ, ShellWarpNode::supportAxesSymmetric;
MObject ShellWarpNode::ties, ShellWarpNode::tieVertex, ShellWarpNode::tieTo, ShellWarpNode::tieToFace, ShellWarpNode::tieStiffness,
    ShellWarpNode::tieWithin;
MObject ShellWarpNode::frameFrom, ShellWarpNode::supportFrame, ShellWarpNode::proxy, ShellWarpNode::proxyVertices,
    ShellWarpNode::proxyThickness;
MObject ShellWarpNode::handles, ShellWarpNode::handleVertex, ShellWarpNode::handleTarget, ShellWarpNode::handlePosition,
    ShellWarpNode::handleOrientation, ShellWarpNode::handleCompliance, ShellWarpNode::handleHeld, ShellWarpNode::handleAxisX,
    ShellWarpNode::handleAxisY, ShellWarpNode::handleAxisZ;
MObject ShellWarpNode::colliders, ShellWarpNode::colliderMesh, ShellWarpNode::colliderMatrix,
    ShellWarpNode::colliderShape, ShellWarpNode::colliderCells, ShellWarpNode::colliderFriction,
    ShellWarpNode::colliderThickness, ShellWarpNode::colliderOneSided, ShellWarpNode::colliderDepth;
MObject ShellWarpNode::contactPatches, ShellWarpNode::contactPatchesNear, ShellWarpNode::contactPatchesMost, ShellWarpNode::pushOut;

using Node = ShellWarpNode;

namespace {

MStatus create_clock_and_loads() {
  MStatus status;
  MFnUnitAttribute unit;
  Node::time = unit.create("time", "tim", MFnUnitAttribute::kTime, 0.0, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::startFrame, "startFrame", "stf", MFnNumericData::kDouble, 1);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnTypedAttribute text;
  Node::cache = text.create("cache", "cfl", MFnData::kString, MObject::kNullObj, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  text.setUsedAsFilename(true);
  status = create_plain(Node::gravityX, "gravityX", "grx", MFnNumericData::kDouble, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::gravityY, "gravityY", "gry", MFnNumericData::kDouble, -981);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::gravityZ, "gravityZ", "grz", MFnNumericData::kDouble, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnNumericAttribute triple;
  Node::gravity = triple.create("gravity", "grv", Node::gravityX, Node::gravityY, Node::gravityZ, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  triple.setKeyable(true);
  return MS::kSuccess;
}

MStatus create_wind() {
  MStatus status;
  status = create_plain(Node::windX, "windX", "wdx", MFnNumericData::kDouble, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::windY, "windY", "wdy", MFnNumericData::kDouble, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::windZ, "windZ", "wdz", MFnNumericData::kDouble, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnNumericAttribute triple;
  Node::wind = triple.create("wind", "wnd", Node::windX, Node::windY, Node::windZ, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  triple.setKeyable(true);
  const host::Wind still;
  status = create_number(Node::airDensity, "airDensity", "adn", still.density, {0, 2});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::normalDrag, "normalDrag", "ndg", still.normal_drag, {0, 2});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::tangentialDrag, "tangentialDrag", "tdg", still.tangential_drag, {0, 1});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  return create_triple(Node::force, {&Node::forceX, &Node::forceY, &Node::forceZ}, "force", "foc", {0, 0, 0});
}

// What is kept in the scene is SW_METHOD_..., which is for good: scenes survive a table that grows.
MStatus create_method() {
  MStatus status;
  MFnEnumAttribute fn;
  Node::method = fn.create("method", "mth", host::kDefaultMethod, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  for (const uint32_t method : host::methods()) fn.addField(sw_method_label(method), static_cast<short>(method));
  fn.setKeyable(false);
  fn.setChannelBox(true);
  status = create_plain(Node::reducedFields, "reducedFields", "rfd", MFnNumericData::kInt, host::kFields);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnNumericAttribute count(Node::reducedFields);
  count.setMin(1);
  count.setSoftMax(100);
  status = create_number(Node::autoError, "autoError", "aer", 0, {0, 1});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::correctionSteps, "correctionSteps", "cst", MFnNumericData::kInt, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnNumericAttribute steps(Node::correctionSteps);
  steps.setMin(0);
  steps.setMax(100);
  return create_choice(Node::integrator, "integrator", "igr", {"exact", "implicitEuler"});
}

// The library's table of known materials.
MStatus create_preset() {
  MStatus status;
  MFnEnumAttribute fn;
  Node::preset = fn.create("preset", "prs", 0, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  for (uint32_t k = 0; k < sw_preset_count(); ++k) fn.addField(sw_preset_label(k), static_cast<short>(k));
  fn.setKeyable(false);
  fn.setChannelBox(true);
  return MS::kSuccess;
}

// Of a sheet, in Pa and kg/m3 whatever Maya's unit is.
MStatus create_sheet() {
  MStatus status = create_preset();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::young, "young", "yng", 3e9, {0, 1e11});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::poisson, "poisson", "poi", 0.3, {-0.99, 0.5});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::volumeDensity, "volumeDensity", "vdn", 1000, {1e-12, 1e4});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::youngAcross, "youngAcross", "yac", 0, {0, 1e11});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::shear, "shear", "shr", 0, {0, 1e11});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_triple(Node::direction, {&Node::directionX, &Node::directionY, &Node::directionZ}, "direction", "dir", {1, 0, 0});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnTypedAttribute text;
  Node::directions = text.create("directions", "dru", MFnData::kString, MObject::kNullObj, &status);
  return status;
}

MStatus create_creases() {
  MStatus status;
  MFnTypedAttribute typed;
  Node::creaseEdges = typed.create("creaseEdges", "ced", MFnData::kComponentList, MObject::kNullObj, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::creaseFactor, "creaseFactor", "cfa", 0.1, {0, 10});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::creaseAngle, "creaseAngle", "can", 0, {-180, 180});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::creaseYield, "creaseYield", "cye", 0, {0, 180});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::creaseSetsAngle, "creaseSetsAngle", "csa", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnCompoundAttribute list;
  Node::creases = list.create("creases", "crs", &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  for (const MObject &child : {Node::creaseEdges, Node::creaseFactor, Node::creaseAngle, Node::creaseSetsAngle, Node::creaseYield}) list.addChild(child);
  list.setArray(true);
  Node::restShape = typed.create("restShape", "rsh", MFnData::kMesh, MObject::kNullObj, &status);
  return status;
}

MStatus create_material() {
  MStatus status;
  status = create_choice(Node::stiffnessFrom, "stiffnessFrom", "sfr", {"frequency", "material", "preset", "sheet", "sag"});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::frequency, "frequency", "frq", 2, {1e-3, 10});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::sag, "sag", "sgl", 1, {1e-6, 10});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::thickness, "thickness", "thk", 0, {0, 1});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::kBend, "kBend", "kbd", 1, {1e-12, 100});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::kStretch, "kStretch", "kst", 1e4, {1e-12, 1e6});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::density, "density", "dns", 1, {1e-12, 10});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::dampingRatio, "dampingRatio", "dra", 0.05, {0, 1});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::dampingMass, "dampingMass", "dms", 0, {0, 10});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::dampingStiffness, "dampingStiffness", "dst", 0, {0, 1});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::stiffnessFactor, "stiffnessFactor", "sfc", 1, {1e-9, 10});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::modes, "modes", "mod", MFnNumericData::kInt, 16);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnNumericAttribute count(Node::modes);
  count.setMin(1);
  count.setMax(1024);
  count.setSoftMax(64);
  status = create_plain(Node::doublePrecision, "doublePrecision", "dbp", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::certify, "certify", "cfy", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  return MS::kSuccess;
}

// Factors on the wind, the damping and a material's constants, and where a force acts.
MStatus create_maps() {
  constexpr float kMost = 100;
  MStatus status;
  status = create_painted(Node::forceMapList, Node::forceMap, {"forceMapList", "fml", "forceMap", "fmp"}, 0, kMost);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_painted(Node::windMapList, Node::windMap, {"windMapList", "wml", "windMap", "wmp"}, 1, kMost);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_painted(Node::dampingMapList, Node::dampingMap, {"dampingMapList", "dpl", "dampingMap", "dpm"}, 1, kMost);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_painted(Node::thicknessMapList, Node::thicknessMap, {"thicknessMapList", "tml", "thicknessMap", "tmp"}, 1, kMost);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_painted(Node::youngMapList, Node::youngMap, {"youngMapList", "yml", "youngMap", "ymp"}, 1, kMost);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_painted(Node::densityMapList, Node::densityMap, {"densityMapList", "dml", "densityMap", "dmp"}, 1, kMost);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_painted(Node::bendMapList, Node::bendMap, {"bendMapList", "bml", "bendMap", "bmp"}, 1, kMost);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_painted(Node::stretchMapList, Node::stretchMap, {"stretchMapList", "sml", "stretchMap", "smp"}, 1, kMost);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  return create_painted(Node::growthMapList, Node::growthMap, {"growthMapList", "gml", "growthMap", "gmp"}, 1, kMost);
}

MStatus create_supports() {
  MStatus status;
  status = create_choice(Node::supportKind, "supportKind", "skd", {"clamped", "hinged"});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::follow, "follow", "fol", MFnNumericData::kBoolean, 1);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::followRest, "followRest", "flr", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::supportFields, "supportFields", "sfd", MFnNumericData::kInt, host::Build().support_fields);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnNumericAttribute fields(Node::supportFields);
  fields.setMin(0);
  fields.setSoftMax(64);
  MFnTypedAttribute typed;
  Node::supportComponents =
      typed.create("supportComponents", "scp", MFnData::kComponentList, MObject::kNullObj, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  Node::proxy = typed.create("proxy", "prx", MFnData::kMesh, MObject::kNullObj, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::proxyVertices, "proxyVertices", "pxv", MFnNumericData::kInt, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnNumericAttribute vertices(Node::proxyVertices);
  vertices.setMin(0);
  vertices.setSoftMax(5000);
  status = create_plain(Node::proxyThickness, "proxyThickness", "pxt", MFnNumericData::kDouble, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnNumericAttribute thickness(Node::proxyThickness);
  thickness.setMin(0);
  thickness.setSoftMax(10);
  status = create_painted(Node::supportWeightList, Node::supportWeights, {"supportWeightList", "swl", "supportWeights", "sws"}, 0, 1);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_choice(Node::frameFrom, "frameFrom", "ffr", {"object", "supportFrame"});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  return create_matrix(Node::supportFrame, "supportFrame", "sfm");
}

// Vertices held along axes, and vertices held together.
MStatus create_partial_supports() {
  MStatus status;
  MFnTypedAttribute typed;
  Node::supportAxesComponents = typed.create("supportAxesComponents", "sac", MFnData::kComponentList, MObject::kNullObj, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::supportAxisX, "supportAxisX", "sux", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::supportAxisY, "supportAxisY", "suy", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::supportAxisZ, "supportAxisZ", "suz", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::supportAxesSymmetric, "supportAxesSymmetric", "sas", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnCompoundAttribute list;
  Node::supportAxes = list.create("supportAxes", "sax", &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  for (const MObject &child : {Node::supportAxesComponents, Node::supportAxisX, Node::supportAxisY, Node::supportAxisZ, Node::supportAxesSymmetric})
    list.addChild(child);
  list.setArray(true);
  status = create_plain(Node::tieVertex, "tieVertex", "tvx", MFnNumericData::kInt, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::tieTo, "tieTo", "tto", MFnNumericData::kInt, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::tieToFace, "tieToFace", "tfa", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::tieStiffness, "tieStiffness", "tst", 0, {0, 1e4});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  Node::ties = list.create("ties", "tis", &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  for (const MObject &child : {Node::tieVertex, Node::tieTo, Node::tieToFace, Node::tieStiffness}) list.addChild(child);
  list.setArray(true);
  return create_number(Node::tieWithin, "tieWithin", "twi", 0, {0, 1});
}

MStatus create_handles() {
  MStatus status;
  status = create_plain(Node::handleVertex, "handleVertex", "hvx", MFnNumericData::kInt, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_matrix(Node::handleTarget, "handleTarget", "htg");
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::handlePosition, "handlePosition", "hps", MFnNumericData::kBoolean, 1);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::handleOrientation, "handleOrientation", "hor", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::handleCompliance, "handleCompliance", "hcp", 0, {0, 1});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::handleHeld, "handleHeld", "hhe", MFnNumericData::kBoolean, 1);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::handleAxisX, "handleAxisX", "hax", MFnNumericData::kBoolean, 1);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::handleAxisY, "handleAxisY", "hay", MFnNumericData::kBoolean, 1);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::handleAxisZ, "handleAxisZ", "haz", MFnNumericData::kBoolean, 1);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnCompoundAttribute list;
  Node::handles = list.create("handles", "hnd", &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  for (const MObject &child :
       {Node::handleVertex, Node::handleTarget, Node::handlePosition, Node::handleOrientation, Node::handleCompliance,
        Node::handleHeld, Node::handleAxisX, Node::handleAxisY, Node::handleAxisZ})
    list.addChild(child);
  list.setArray(true);
  return MS::kSuccess;
}

// In the order of SW_COLLIDER_...; the closed mesh is the default, whatever its place.
MStatus create_collider_shape() {
  MStatus status;
  MFnEnumAttribute fn;
  Node::colliderShape = fn.create("colliderShape", "csh", SW_COLLIDER_MESH, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  short kind = SW_COLLIDER_PLANE;
  for (const char *shape : {"plane", "sphere", "capsule", "box", "hull", "mesh", "deforming"}) fn.addField(shape, kind++);
  return MS::kSuccess;
}

MStatus create_colliders() {
  MStatus status;
  MFnTypedAttribute typed;
  Node::colliderMesh = typed.create("colliderMesh", "cme", MFnData::kMesh, MObject::kNullObj, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_matrix(Node::colliderMatrix, "colliderMatrix", "cma");
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_collider_shape();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::colliderCells, "colliderCells", "cce", MFnNumericData::kInt, 64);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnNumericAttribute cells(Node::colliderCells);
  cells.setMin(4);
  cells.setMax(2000);
  status = create_number(Node::colliderFriction, "colliderFriction", "cfr", 0.3, {0, 1});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::colliderThickness, "colliderThickness", "cth", 0, {0, 1});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::colliderOneSided, "colliderOneSided", "cos", MFnNumericData::kBoolean, 0);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::colliderDepth, "colliderDepth", "cdp", 0, {0, 10});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnCompoundAttribute list;
  Node::colliders = list.create("colliders", "col", &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  for (const MObject &child : {Node::colliderMesh, Node::colliderMatrix, Node::colliderShape, Node::colliderCells,
                               Node::colliderFriction, Node::colliderThickness, Node::colliderOneSided, Node::colliderDepth})
    list.addChild(child);
  list.setArray(true);
  Node::contactPatches = typed.create("contactPatches", "cpa", MFnData::kComponentList, MObject::kNullObj, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_number(Node::contactPatchesNear, "contactPatchesNear", "cpn", 0, {0, 10});
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_plain(Node::contactPatchesMost, "contactPatchesMost", "cpm", MFnNumericData::kInt, host::Build().most_patches);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MFnNumericAttribute most(Node::contactPatchesMost);
  most.setMin(1);
  most.setMax(128);
  return create_plain(Node::pushOut, "pushOut", "pou", MFnNumericData::kBoolean, 0);
}

}  // namespace

// Children come with their parents; but each of them must be declared to affect the output by itself.
MStatus ShellWarpNode::addAttributes() {
  const MObject parents[] = {
      time,          startFrame,   gravity,      stiffnessFrom, frequency, sag, thickness,         kBend,
      kStretch,      density,      dampingRatio, dampingMass,   modes,       doublePrecision,   method,
      reducedFields, autoError,    correctionSteps, integrator, certify,       supportKind, supportComponents, supportWeightList,
      frameFrom,     supportFrame, handles,      preset,        young,       poisson,           volumeDensity,
      colliders,     proxy,        follow,       supportFields, wind,       airDensity,        normalDrag,
      tangentialDrag, dampingStiffness, cache,  thicknessMapList, youngMapList,     densityMapList, bendMapList, stretchMapList, growthMapList, proxyVertices, proxyThickness,
      contactPatches, contactPatchesNear, contactPatchesMost, pushOut, dampingMapList, stiffnessFactor,
      youngAcross, shear, direction, directions, creases, restShape, supportAxes, ties, tieWithin, force, forceMapList, windMapList, followRest};
  const MObject children[] = {windMap, windX, windY, windZ, gravityX,       gravityY,       gravityZ,          supportWeights,   dampingMap, thicknessMap, youngMap, densityMap, bendMap, stretchMap, growthMap, handleVertex,
                              handleTarget,   handlePosition, handleOrientation, handleCompliance, handleHeld, handleAxisX, handleAxisY, handleAxisZ, colliderMesh,
                              colliderMatrix, colliderShape,  colliderCells,     colliderFriction, colliderThickness, colliderOneSided, colliderDepth,
                              directionX, directionY, directionZ, creaseEdges, creaseFactor, creaseAngle, creaseSetsAngle, creaseYield,
                              supportAxesComponents, supportAxisX, supportAxisY, supportAxisZ, supportAxesSymmetric, tieVertex, tieTo, tieToFace, tieStiffness, forceX, forceY, forceZ, forceMap};
  MStatus status;
  for (const MObject &attribute : parents) {
    status = addAttribute(attribute);
    CHECK_MSTATUS_AND_RETURN_IT(status);
    status = attributeAffects(attribute, outputGeom);
    CHECK_MSTATUS_AND_RETURN_IT(status);
  }
  for (const MObject &attribute : children) {
    status = attributeAffects(attribute, outputGeom);
    CHECK_MSTATUS_AND_RETURN_IT(status);
  }
  return MS::kSuccess;
}

MStatus ShellWarpNode::initialize() {
  MStatus status;
  status = create_clock_and_loads();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_wind();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_material();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_method();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_supports();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_partial_supports();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_handles();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_sheet();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_creases();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_maps();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = create_colliders();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = addAttributes();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  // What Artisan offers in the Paint Attributes tool.
  for (const char *map : {"weights", "supportWeights", "forceMap", "windMap", "dampingMap", "thicknessMap", "youngMap", "densityMap", "bendMap", "stretchMap", "growthMap"})
    MGlobal::executeCommand(MString("makePaintable -attrType multiFloat -sm deformer ") + nodeName + " " + map);
  return MS::kSuccess;
}
