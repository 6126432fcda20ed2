#include "pull.hpp"

#include "message.hpp"
#include "shell_parts.hpp"
#include "shell_warp_node.hpp"

#include <maya/MArrayDataHandle.h>
#include <maya/MDataHandle.h>
#include <maya/MFnComponentListData.h>
#include <maya/MFloatArray.h>
#include <maya/MFnMesh.h>
#include <maya/MFnSingleIndexedComponent.h>
#include <maya/MIntArray.h>
#include <maya/MPointArray.h>
#include <maya/MTime.h>

#include <algorithm>
#include <utility>

using Node = ShellWarpNode;

host::Matrix4 matrix_of(const MMatrix &matrix) {
  host::Matrix4 out;
  for (unsigned int i = 0; i < 4; ++i)
    for (unsigned int j = 0; j < 4; ++j) out[4 * i + j] = matrix(i, j);
  return out;
}

namespace {

std::vector<uint32_t> indices_of(const MIntArray &array) {
  std::vector<uint32_t> out(array.length());
  for (unsigned int i = 0; i < array.length(); ++i) out[i] = static_cast<uint32_t>(array[i]);
  return out;
}

// Points and polygons in the mesh's own space.
MStatus read_mesh(const MObject &data, host::Mesh &mesh) {
  MStatus status;
  MFnMesh fn(data, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MPointArray points;
  MIntArray counts, corners;
  status = fn.getPoints(points);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = fn.getVertices(counts, corners);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  mesh.points.resize(3 * static_cast<std::size_t>(points.length()));
  for (unsigned int i = 0; i < points.length(); ++i) {
    mesh.points[3 * i] = points[i].x;
    mesh.points[3 * i + 1] = points[i].y;
    mesh.points[3 * i + 2] = points[i].z;
  }
  mesh.sizes = indices_of(counts);
  mesh.corners = indices_of(corners);
  return MS::kSuccess;
}

// Where an object is; its scale goes into the mesh.
void place(const MMatrix &matrix, host::Collider &collider) {
  const host::Matrix4 m = matrix_of(matrix);
  collider.pose = host::pose_of(m, collider.name.c_str(), host::Scale::ignored);
  const host::Vec3 scale = host::scale_of(m);
  for (std::size_t i = 0; i < collider.mesh.points.size(); ++i) collider.mesh.points[i] *= scale[i % 3];
}

void add_painted(MDataBlock &block, unsigned int multiIndex, host::Request &request) {
  MArrayDataHandle list = block.inputArrayValue(Node::supportWeightList);
  if (list.jumpToElement(multiIndex) != MS::kSuccess) return;  // never painted
  MDataHandle element = list.inputValue();
  const std::size_t n_points = (request.drawn.empty() ? request.mesh.points : request.drawn).size() / 3;
  MArrayDataHandle weights(element.child(Node::supportWeights));
  for (unsigned int k = 0, n = weights.elementCount(); k < n; ++k, weights.next()) {
    const uint32_t vertex = weights.elementIndex();
    // What was painted on a mesh that has fewer vertices by now stays in the map.
    if (weights.inputValue().asFloat() >= 0.5f && vertex < n_points)
      request.build.held.push_back(vertex);
  }
}

// What was never painted is `unpainted`.
void add_factors(MDataBlock &block, unsigned int multiIndex, const MObject &list, const MObject &map, std::size_t n_points,
                 std::vector<double> &factors, double unpainted = 1) {
  MArrayDataHandle all = block.inputArrayValue(list);
  if (all.jumpToElement(multiIndex) != MS::kSuccess) return;
  MArrayDataHandle painted(all.inputValue().child(map));
  const unsigned int n = painted.elementCount();
  if (n > 0) factors.assign(n_points, unpainted);
  for (unsigned int k = 0; k < n; ++k, painted.next())
    if (painted.elementIndex() < n_points) factors[painted.elementIndex()] = static_cast<double>(painted.inputValue().asFloat());
}

// What a list of components names of one kind; `name` is its attribute's, `kinds` what it may hold.
std::vector<uint32_t> listed(const MObject &data, const char *name, MFn::Type kind, const char *kinds) {
  std::vector<uint32_t> all;
  if (data.isNull()) return all;
  MStatus status;
  MFnComponentListData list(data, &status);
  if (status != MS::kSuccess) return all;
  for (unsigned int k = 0; k < list.length(); ++k) {
    const MObject component = list[k];
    if (!component.hasFn(kind)) throw host::HostError(std::string(name) + " holds more than " + kinds);
    MIntArray elements;
    MFnSingleIndexedComponent(component).getElements(elements);
    const std::vector<uint32_t> some = indices_of(elements);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

std::vector<uint32_t> vertices_of(const MObject &data, const char *name) {
  return listed(data, name, MFn::kMeshVertComponent, "vertices");
}

}  // namespace

namespace {

MStatus deformed_mesh(MDataBlock &block, const MObject &input, const MObject &inputGeom, unsigned int multiIndex, MObject &data) {
  MStatus status;
  // The output's view of the input: the geometry was evaluated for this call, and is not to be evaluated again.
  MArrayDataHandle inputs = block.outputArrayValue(input, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = inputs.jumpToElement(multiIndex);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  MDataHandle element = inputs.outputValue(&status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  data = element.child(inputGeom).asMesh();
  if (data.isNull()) throw host::HostError("only polygon meshes can be shells");
  return MS::kSuccess;
}

// Of each corner, in the order of the polygons' corners.
std::vector<double> corner_uvs(const MFnMesh &mesh, const MString &set) {
  MFloatArray us, vs;
  MIntArray counts, ids;
  if (mesh.getUVs(us, vs, &set) != MS::kSuccess || mesh.getAssignedUVs(counts, ids, &set) != MS::kSuccess || us.length() == 0)
    throw host::HostError(std::string("directions: the mesh has no UV set ") + set.asChar());
  std::vector<double> uvs;
  for (unsigned int i = 0; i < ids.length(); ++i) {
    const unsigned int at = static_cast<unsigned int>(ids[i]);
    uvs.insert(uvs.end(), {static_cast<double>(us[at]), static_cast<double>(vs[at])});
  }
  return uvs;
}

void add_creases(MDataBlock &block, const MFnMesh &mesh, std::vector<host::Crease> &creases) {
  constexpr double kRadians = 3.141592653589793 / 180;
  MArrayDataHandle list = block.inputArrayValue(Node::creases);
  for (unsigned int k = 0, n = list.elementCount(); k < n; ++k, list.next()) {
    MDataHandle element = list.inputValue();
    const std::string name = "creases[" + host::number(uint64_t(list.elementIndex())) + "]";
    host::Crease crease;
    crease.factor = element.child(Node::creaseFactor).asDouble();
    if (element.child(Node::creaseSetsAngle).asBool()) crease.angle = kRadians * element.child(Node::creaseAngle).asDouble();
    crease.yield = kRadians * element.child(Node::creaseYield).asDouble();
    for (const uint32_t edge : listed(element.child(Node::creaseEdges).data(), name.c_str(), MFn::kMeshEdgeComponent, "edges")) {
      int2 ends;
      if (mesh.getEdgeVertices(static_cast<int>(edge), ends) != MS::kSuccess)
        throw host::HostError(name + " names edge " + host::number(uint64_t(edge)) + ", which there is not");
      crease.a = static_cast<uint32_t>(ends[0]), crease.b = static_cast<uint32_t>(ends[1]);
      creases.push_back(crease);
    }
  }
}

}  // namespace

MStatus pull_mesh(MDataBlock &block, const MObject &input, const MObject &inputGeom, unsigned int multiIndex,
                  host::Mesh &mesh) {
  MObject data;
  const MStatus status = deformed_mesh(block, input, inputGeom, multiIndex, data);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  return read_mesh(data, mesh);
}

MStatus pull_build(MDataBlock &block, const MObject &input, const MObject &inputGeom, unsigned int multiIndex, host::Request &request) {
  MObject data;
  MStatus status = deformed_mesh(block, input, inputGeom, multiIndex, data);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  const MFnMesh mesh(data, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  add_creases(block, mesh, request.build.creases);
  const MString set = block.inputValue(Node::directions).asString();
  host::Stiffness &s = request.build.stiffness;
  if (s.young_across > 0 && set.length()) {
    host::Mesh drawn;
    status = read_mesh(data, drawn);
    CHECK_MSTATUS_AND_RETURN_IT(status);
    s.directions = host::directions_of_uvs(drawn, corner_uvs(mesh, set));
    s.middles = host::middles_of(drawn);
  }
  const MObject rest = block.inputValue(Node::restShape).asMesh();
  if (rest.isNull()) return MS::kSuccess;
  host::Mesh shape;
  status = read_mesh(rest, shape);
  request.build.rest_shape = std::move(shape.points);
  return status;
}

MStatus pull_proxy(MDataBlock &block, host::Request &request) {
  const MObject data = block.inputValue(Node::proxy).asMesh();
  if (data.isNull()) return MS::kSuccess;
  request.drawn = std::move(request.mesh.points);
  request.mesh = {};
  return read_mesh(data, request.mesh);
}

void pull_settings(MDataBlock &block, host::Request &request) {
  const auto real = [&block](const MObject &attribute) { return block.inputValue(attribute).asDouble(); };
  const auto count = [&block](const MObject &attribute) {
    return static_cast<uint32_t>(std::max(block.inputValue(attribute).asInt(), 0));
  };
  const auto second = [&block](const MObject &choice) { return block.inputValue(choice).asShort() == 1; };

  request.time = block.inputValue(Node::time).asTime().as(MTime::kSeconds);
  request.motion.start_time = MTime(real(Node::startFrame), MTime::uiUnit()).as(MTime::kSeconds);
  request.motion.frame_rate = MTime(1.0, MTime::kSeconds).as(MTime::uiUnit());
  request.motion.implicit_euler = second(Node::integrator);
  request.motion.damping_ratio = real(Node::dampingRatio);
  request.motion.damping_mass = real(Node::dampingMass);
  request.motion.damping_stiffness = real(Node::dampingStiffness);

  host::Stiffness &stiffness = request.build.stiffness;
  stiffness.by = static_cast<host::Stiffness::By>(block.inputValue(Node::stiffnessFrom).asShort());
  stiffness.frequency = real(Node::frequency);
  stiffness.sag = real(Node::sag);
  stiffness.thickness = real(Node::thickness);
  stiffness.bend = real(Node::kBend);
  stiffness.stretch = real(Node::kStretch);
  stiffness.density = real(Node::density);
  stiffness.preset = static_cast<uint32_t>(block.inputValue(Node::preset).asShort());
  stiffness.young = real(Node::young);
  stiffness.poisson = real(Node::poisson);
  stiffness.volume_density = real(Node::volumeDensity);
  stiffness.young_across = real(Node::youngAcross);
  stiffness.shear = real(Node::shear);
  const double3 &along = block.inputValue(Node::direction).asDouble3();
  stiffness.directions = {along[0], along[1], along[2]};
  request.build.modes = count(Node::modes);
  request.build.method = static_cast<uint32_t>(block.inputValue(Node::method).asShort());
  request.build.reduced_fields = count(Node::reducedFields);
  request.build.auto_error = real(Node::autoError);
  request.build.double_precision = block.inputValue(Node::doublePrecision).asBool();
  request.build.clamped = !second(Node::supportKind);
  request.follow = block.inputValue(Node::follow).asBool();
  request.follow_rest = block.inputValue(Node::followRest).asBool();
  request.build.support_fields = count(Node::supportFields);
  request.proxy.vertices = count(Node::proxyVertices);
  request.proxy.thickness = real(Node::proxyThickness);
  request.correction_steps = count(Node::correctionSteps);
  request.push_out = block.inputValue(Node::pushOut).asBool();
  request.build.contact_patches = vertices_of(block.inputValue(Node::contactPatches).data(), "contactPatches");
  request.build.patches_near = real(Node::contactPatchesNear);
  request.build.most_patches = count(Node::contactPatchesMost);
  request.certify = block.inputValue(Node::certify).asBool();

  const double3 &gravity = block.inputValue(Node::gravity).asDouble3();
  request.inputs.stiffness_factor = real(Node::stiffnessFactor);
  request.inputs.gravity = {gravity[0], gravity[1], gravity[2]};
  const double3 &wind = block.inputValue(Node::wind).asDouble3();
  request.inputs.wind = {{wind[0], wind[1], wind[2]}, real(Node::airDensity), real(Node::normalDrag), real(Node::tangentialDrag)};
}

void pull_maps(MDataBlock &block, unsigned int multiIndex, host::Request &request) {
  host::Stiffness &s = request.build.stiffness;
  const std::size_t n_points = (request.drawn.empty() ? request.mesh.points : request.drawn).size() / 3;
  std::vector<double> shares;
  add_factors(block, multiIndex, Node::forceMapList, Node::forceMap, n_points, shares, 0);
  const double3 &force = block.inputValue(Node::force).asDouble3();
  if (force[0] != 0 || force[1] != 0 || force[2] != 0)
    for (const double share : shares) request.inputs.forces.insert(request.inputs.forces.end(), {share * force[0], share * force[1], share * force[2]});
  std::vector<double> sheltered;
  add_factors(block, multiIndex, Node::windMapList, Node::windMap, n_points, sheltered);
  host::Wind &wind = request.inputs.wind;
  for (const double share : sheltered)
    for (const double v : wind.velocity) wind.local.push_back((share - 1) * v);
  add_factors(block, multiIndex, Node::dampingMapList, Node::dampingMap, n_points, request.motion.damping_map);
  add_factors(block, multiIndex, Node::thicknessMapList, Node::thicknessMap, n_points, s.thickness_map);
  add_factors(block, multiIndex, Node::youngMapList, Node::youngMap, n_points, s.young_map);
  add_factors(block, multiIndex, Node::densityMapList, Node::densityMap, n_points, s.density_map);
  add_factors(block, multiIndex, Node::bendMapList, Node::bendMap, n_points, s.bend_map);
  add_factors(block, multiIndex, Node::stretchMapList, Node::stretchMap, n_points, s.stretch_map);
  add_factors(block, multiIndex, Node::growthMapList, Node::growthMap, n_points, s.growth_map);
}

static void add_axes(MDataBlock &block, std::vector<host::AxisSupport> &supports) {
  MArrayDataHandle list = block.inputArrayValue(Node::supportAxes);
  for (unsigned int k = 0, n = list.elementCount(); k < n; ++k, list.next()) {
    MDataHandle element = list.inputValue();
    const std::string name = "supportAxes[" + host::number(uint64_t(list.elementIndex())) + "]";
    const uint32_t axes = (element.child(Node::supportAxisX).asBool() ? SW_AXIS_X : 0u) | (element.child(Node::supportAxisY).asBool() ? SW_AXIS_Y : 0u) |
                          (element.child(Node::supportAxisZ).asBool() ? SW_AXIS_Z : 0u);
    const uint32_t symmetric = element.child(Node::supportAxesSymmetric).asBool() ? axes : 0u;
    for (const uint32_t vertex : vertices_of(element.child(Node::supportAxesComponents).data(), name.c_str())) supports.push_back({vertex, axes, symmetric});
  }
}

static void add_ties(MDataBlock &block, host::Build &build) {
  build.tie_within = block.inputValue(Node::tieWithin).asDouble();
  MArrayDataHandle list = block.inputArrayValue(Node::ties);
  for (unsigned int k = 0, n = list.elementCount(); k < n; ++k, list.next()) {
    MDataHandle element = list.inputValue();
    const int vertex = element.child(Node::tieVertex).asInt(), to = element.child(Node::tieTo).asInt();
    if (vertex < 0 || to < 0) throw host::HostError("ties[" + host::number(uint64_t(list.elementIndex())) + "] has a negative number");
    build.ties.push_back({static_cast<uint32_t>(vertex), static_cast<uint32_t>(to), element.child(Node::tieToFace).asBool(),
                          element.child(Node::tieStiffness).asDouble()});
  }
}

void pull_supports(MDataBlock &block, unsigned int multiIndex, host::Request &request) {
  add_painted(block, multiIndex, request);
  const std::vector<uint32_t> more = vertices_of(block.inputValue(Node::supportComponents).data(), "supportComponents");
  request.build.held.insert(request.build.held.end(), more.begin(), more.end());
  add_axes(block, request.build.axis_supports);
  add_ties(block, request.build);
}

void pull_handles(MDataBlock &block, std::vector<host::Handle> &handles) {
  MArrayDataHandle list = block.inputArrayValue(Node::handles);
  for (unsigned int k = 0, n = list.elementCount(); k < n; ++k, list.next()) {
    MDataHandle element = list.inputValue();
    host::Handle handle;
    handle.position = element.child(Node::handlePosition).asBool();
    handle.orientation = element.child(Node::handleOrientation).asBool();
    handle.compliance = element.child(Node::handleCompliance).asDouble();
    handle.held = element.child(Node::handleHeld).asBool();
    handle.axes = (element.child(Node::handleAxisX).asBool() ? SW_AXIS_X : 0u) | (element.child(Node::handleAxisY).asBool() ? SW_AXIS_Y : 0u) |
                  (element.child(Node::handleAxisZ).asBool() ? SW_AXIS_Z : 0u);
    const int vertex = element.child(Node::handleVertex).asInt();
    const std::string name = "handles[" + host::number(uint64_t(list.elementIndex())) + "]";
    if (vertex < 0) throw host::HostError(name + " has a negative vertex");
    handle.vertex = static_cast<uint32_t>(vertex);
    handle.target =
        host::pose_of(matrix_of(element.child(Node::handleTarget).asMatrix()), name.c_str(), host::Scale::ignored);
    handles.push_back(handle);
  }
}

MStatus pull_colliders(MDataBlock &block, std::vector<host::Collider> &colliders) {
  MArrayDataHandle list = block.inputArrayValue(Node::colliders);
  for (unsigned int k = 0, n = list.elementCount(); k < n; ++k, list.next()) {
    MDataHandle element = list.inputValue();
    const MObject data = element.child(Node::colliderMesh).asMesh();
    if (data.isNull()) continue;  // nothing is connected: a mesh that was deleted leaves its element behind
    host::Collider collider;
    collider.name = "colliders[" + host::number(uint64_t(list.elementIndex())) + "]";
    collider.kind = static_cast<uint32_t>(element.child(Node::colliderShape).asShort());
    collider.cells = static_cast<uint32_t>(element.child(Node::colliderCells).asInt());
    collider.friction = element.child(Node::colliderFriction).asDouble();
    collider.thickness = element.child(Node::colliderThickness).asDouble();
    collider.one_sided = element.child(Node::colliderOneSided).asBool();
    collider.depth = element.child(Node::colliderDepth).asDouble();
    const MStatus status = read_mesh(data, collider.mesh);
    CHECK_MSTATUS_AND_RETURN_IT(status);
    place(element.child(Node::colliderMatrix).asMatrix(), collider);
    colliders.push_back(std::move(collider));
  }
  return MS::kSuccess;
}
