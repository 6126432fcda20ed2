#include "pull.hpp"

#include "blend.hpp"
#include "message.hpp"

#include <GA/GA_EdgeGroup.h>
#include <GA/GA_Handle.h>
#include <GA/GA_Iterator.h>
#include <GEO/GEO_PrimPoly.h>
#include <GOP/GOP_Manager.h>
#include <UT/UT_Quaternion.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

namespace {

uint32_t index_of(const GU_Detail &detail, GA_Offset offset) {
  return static_cast<uint32_t>(detail.pointIndex(offset));
}

GA_ROHandleF float_attribute(const GU_Detail &detail, const UT_StringHolder &name) {
  const GA_ROHandleF handle(&detail, GA_ATTRIB_POINT, name);
  if (!handle.isValid()) throw host::HostError(std::string("there is no point attribute ") + name.c_str());
  return handle;
}

GA_ROHandleI integer_attribute(const GU_Detail &detail, const UT_StringHolder &name) {
  const GA_ROHandleI handle(&detail, GA_ATTRIB_POINT, name);
  if (!handle.isValid()) throw host::HostError(std::string("there is no integer of points ") + name.c_str());
  return handle;
}

// Twice the polygon's area as a vector. Houdini's polygons are seen from where they run clockwise.
void area_of(const GA_Primitive &polygon, const std::vector<double> &points, double (&area)[3]) {
  area[0] = area[1] = area[2] = 0;
  const GA_Size n = polygon.getVertexCount();
  for (GA_Size k = 0; k < n; ++k) {
    const double *a = &points[3 * static_cast<std::size_t>(polygon.getPointIndex((k + 1) % n))];
    const double *b = &points[3 * static_cast<std::size_t>(polygon.getPointIndex(k))];
    for (int i = 0; i < 3; ++i) area[i] += a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
  }
}

}  // namespace

std::vector<double> points_of(const GU_Detail &detail) {
  std::vector<double> points(3 * static_cast<std::size_t>(detail.getNumPoints()));
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it) {
    const UT_Vector3 x = detail.getPos3(*it);
    double *to = &points[3 * std::size_t(index_of(detail, *it))];
    to[0] = x.x(), to[1] = x.y(), to[2] = x.z();
  }
  return points;
}

void pull_mesh(const GU_Detail &detail, host::Mesh &mesh, std::vector<std::size_t> *starts) {
  mesh.points = points_of(detail);
  for (GA_Iterator it(detail.getPrimitiveRange()); !it.atEnd(); ++it) {
    const GA_Primitive *primitive = detail.getPrimitive(*it);
    if (primitive->getTypeId().get() != GEO_PRIMPOLY || !static_cast<const GEO_PrimPoly *>(primitive)->isClosed())
      throw host::HostError("primitive " + host::number(uint64_t(detail.primitiveIndex(*it))) +
                            " is no closed polygon; convert it, or delete it before the shell");
    const GA_Size n = primitive->getVertexCount();
    if (starts) starts->push_back(mesh.corners.size());
    if (n < 3) continue;
    mesh.sizes.push_back(static_cast<uint32_t>(n));
    for (GA_Size k = 0; k < n; ++k) mesh.corners.push_back(static_cast<uint32_t>(primitive->getPointIndex(k)));
  }
  if (starts) starts->push_back(mesh.corners.size());
}

void pull_map(const GU_Detail &detail, const UT_StringHolder &attribute, std::vector<double> &factors) {
  if (!attribute.isstring()) return;
  const GA_ROHandleF painted = float_attribute(detail, attribute);
  factors.resize(static_cast<std::size_t>(detail.getNumPoints()));
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it) factors[index_of(detail, *it)] = static_cast<double>(painted.get(*it));
}

std::vector<double> pull_vectors(const GU_Detail &detail, const UT_StringHolder &attribute) {
  const GA_ROHandleV3 handle(&detail, GA_ATTRIB_POINT, attribute);
  if (!handle.isValid()) throw host::HostError(std::string("there is no point attribute ") + attribute.c_str() + " of three numbers");
  std::vector<double> vectors(3 * static_cast<std::size_t>(detail.getNumPoints()));
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it) {
    const UT_Vector3 v = handle.get(*it);
    double *to = &vectors[3 * std::size_t(index_of(detail, *it))];
    to[0] = v.x(), to[1] = v.y(), to[2] = v.z();
  }
  return vectors;
}

void pull_directions(const GU_Detail &detail, const UT_StringHolder &attribute, host::Stiffness &stiffness) {
  const GA_ROHandleV3 own(&detail, GA_ATTRIB_PRIMITIVE, attribute);
  const std::vector<double> of_points = own.isValid() ? std::vector<double>() : pull_vectors(detail, attribute), places = points_of(detail);
  stiffness.directions.clear();
  for (GA_Iterator it(detail.getPrimitiveRange()); !it.atEnd(); ++it) {
    const GA_Primitive *polygon = detail.getPrimitive(*it);
    const GA_Size n = polygon->getVertexCount();
    if (n < 3) continue;
    double sum[3] = {0, 0, 0}, middle[3] = {0, 0, 0};
    for (GA_Size k = 0; k < n; ++k)
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t at = 3 * static_cast<std::size_t>(polygon->getPointIndex(k)) + c;
        middle[c] += places[at] / static_cast<double>(n);
        if (!own.isValid()) sum[c] += of_points[at];
      }
    if (own.isValid()) {
      const UT_Vector3 v = own.get(*it);
      sum[0] = v.x(), sum[1] = v.y(), sum[2] = v.z();
    }
    stiffness.directions.insert(stiffness.directions.end(), sum, sum + 3);
    stiffness.middles.insert(stiffness.middles.end(), middle, middle + 3);
  }
}

void pull_edges(const GU_Detail &detail, const UT_StringHolder &group, const host::Crease &common, std::vector<host::Crease> &creases) {
  if (!group.isstring()) return;
  GOP_Manager groups;
  const GA_EdgeGroup *members = groups.parseEdgeGroups(group.c_str(), GOP_Manager::GroupCreator(&detail), true);
  if (!members) throw host::HostError(std::string("there are no edges of the group ") + group.c_str());
  const GA_ROHandleF factors(&detail, GA_ATTRIB_POINT, "creasefactor"), angles(&detail, GA_ATTRIB_POINT, "creaseangle"), yields(&detail, GA_ATTRIB_POINT, "creaseyield");
  for (GA_EdgeGroup::const_iterator it = members->begin(); !it.atEnd(); ++it) {
    const auto mean = [&it](const GA_ROHandleF &of_points) { return (static_cast<double>(of_points.get(it->p0())) + static_cast<double>(of_points.get(it->p1()))) / 2; };
    host::Crease crease = common;
    crease.a = index_of(detail, it->p0()), crease.b = index_of(detail, it->p1());
    if (factors.isValid()) crease.factor = mean(factors);
    if (crease.angle && angles.isValid()) crease.angle = mean(angles);
    if (yields.isValid()) crease.yield = mean(yields);
    crease.yield *= 3.141592653589793 / 180;
    if (crease.angle) crease.angle = -3.141592653589793 / 180 * *crease.angle;  // corners run clockwise here
    creases.push_back(crease);
  }
}

void pull_group(const GU_Detail &detail, const UT_StringHolder &group, std::vector<uint32_t> &points) {
  if (!group.isstring()) return;
  GOP_Manager groups;  // owns what a pattern makes
  const GA_PointGroup *members = groups.parsePointGroups(group, GOP_Manager::GroupCreator(&detail));
  if (!members) throw host::HostError(std::string("there are no points of the group ") + group.c_str());
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it)
    if (members->containsOffset(*it)) points.push_back(index_of(detail, *it));
}

void pull_supports(const GU_Detail &detail, const UT_StringHolder &group, const UT_StringHolder &attribute,
                   std::vector<uint32_t> &held) {
  pull_group(detail, group, held);
  if (!attribute.isstring()) return;
  const GA_ROHandleF painted = float_attribute(detail, attribute);
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it)
    if (painted.get(*it) >= 0.5f) held.push_back(index_of(detail, *it));
}

void pull_axes(const GU_Detail &detail, const UT_StringHolder &attribute, std::vector<host::AxisSupport> &supports) {
  if (!attribute.isstring()) return;
  const GA_ROHandleI axes = integer_attribute(detail, attribute);
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it)
    if (const int bits = axes.get(*it)) supports.push_back({index_of(detail, *it), static_cast<uint32_t>(bits) & 7u, static_cast<uint32_t>(bits) >> 3 & 7u});
}

void pull_ties(const GU_Detail &detail, const UT_StringHolder &attribute, bool to_face, double stiffness, std::vector<host::Tie> &ties) {
  if (!attribute.isstring()) return;
  const GA_ROHandleI to = integer_attribute(detail, attribute);
  std::vector<uint32_t> polygons;  // of primitives, as pull_mesh counts those that it takes
  uint32_t taken = 0;
  for (GA_Iterator it(detail.getPrimitiveRange()); to_face && !it.atEnd(); ++it) {
    polygons.push_back(taken);
    taken += detail.getPrimitive(*it)->getVertexCount() >= 3;
  }
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it) {
    const int wanted = to.get(*it);
    if (wanted < 0) continue;
    const std::size_t end = static_cast<std::size_t>(wanted);
    ties.push_back({index_of(detail, *it), to_face && end < polygons.size() ? polygons[end] : static_cast<uint32_t>(wanted), to_face, stiffness});
  }
}

void pull_handles(const GU_Detail &points, std::vector<host::Handle> &handles) {
  const GA_ROHandleI vertex(&points, GA_ATTRIB_POINT, "shellpoint"), position(&points, GA_ATTRIB_POINT, "holdposition"),
      orientation(&points, GA_ATTRIB_POINT, "holdorientation"), holds(&points, GA_ATTRIB_POINT, "held"),
      axes(&points, GA_ATTRIB_POINT, "axes");
  const GA_ROHandleF compliance(&points, GA_ATTRIB_POINT, "compliance");
  const GA_ROHandleQ orient(&points, GA_ATTRIB_POINT, "orient");
  if (points.getNumPoints() > 0 && !vertex.isValid())
    throw host::HostError(
        "the points of the second input need i@shellpoint, the number of the point that each of them holds");
  for (GA_Iterator it(points.getPointRange()); !it.atEnd(); ++it) {
    host::Handle handle;
    const int held = vertex.get(*it);
    if (held < 0) throw host::HostError("handle " + host::number(uint64_t(handles.size())) + " holds a negative point");
    handle.vertex = static_cast<uint32_t>(held);
    const UT_Vector3 x = points.getPos3(*it);
    handle.target.origin = {x.x(), x.y(), x.z()};
    if (orient.isValid()) {
      const UT_Quaternion q = orient.get(*it);
      handle.target.rotation = host::rotation_of_quaternion({q.x(), q.y(), q.z(), q.w()});
    }
    if (position.isValid()) handle.position = position.get(*it) != 0;
    if (orientation.isValid()) handle.orientation = orientation.get(*it) != 0;
    if (compliance.isValid()) handle.compliance = static_cast<double>(compliance.get(*it));
    if (holds.isValid()) handle.held = holds.get(*it) != 0;
    if (axes.isValid()) handle.axes = static_cast<uint32_t>(axes.get(*it)) & (SW_AXIS_X | SW_AXIS_Y | SW_AXIS_Z);
    handles.push_back(handle);
  }
}

void push(GU_Detail &detail, const host::ShellRunner &runner, double envelope, const UT_StringHolder &weights) {
  GA_ROHandleF weight;
  if (weights.isstring()) weight = float_attribute(detail, weights);
  GA_RWHandleV3 velocity;
  if (!runner.velocities().empty()) {
    GA_RWAttributeRef attribute = detail.findFloatTuple(GA_ATTRIB_POINT, "v", 3, 3);
    if (!attribute.isValid()) {
      attribute = detail.addFloatTuple(GA_ATTRIB_POINT, "v", 3);
      attribute.setTypeInfo(GA_TYPE_VECTOR);
    }
    velocity = GA_RWHandleV3(attribute);
  }
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it) {
    const std::size_t at = 3 * std::size_t(index_of(detail, *it));
    const UT_Vector3 x = detail.getPos3(*it);
    const double in[3] = {x.x(), x.y(), x.z()};
    double out[3];
    const double share = weight.isValid() ? envelope * static_cast<double>(weight.get(*it)) : envelope;
    host::blend_point(out, in, runner.replaces() ? in : &runner.rest()[at], &runner.deformed()[at], share);
    detail.setPos3(*it, UT_Vector3(static_cast<float>(out[0]), static_cast<float>(out[1]), static_cast<float>(out[2])));
    if (!velocity.isValid()) continue;
    // What came in moves as well: the shell's motion is added to its v, or takes its place as the points do.
    const UT_Vector3 before = velocity.get(*it);
    const double v_in[3] = {before.x(), before.y(), before.z()}, none[3] = {0, 0, 0};
    double v[3];
    host::blend_point(v, v_in, runner.replaces() ? v_in : none, &runner.velocities()[at], share);
    velocity.set(*it, UT_Vector3(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])));
  }
  detail.getP()->bumpDataId();
  if (velocity.isValid()) velocity.bumpDataId();
}

namespace {

UT_Vector3 unit(const double *n, const UT_Vector3 &before) {
  const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  return length > 0 ? UT_Vector3(static_cast<float>(n[0] / length), static_cast<float>(n[1] / length), static_cast<float>(n[2] / length)) : before;
}

bool is_near(const UT_Vector3 &a, const UT_Vector3 &b) {
  constexpr float kSame = 1e-4f;  // of what a node upstream has rounded twice
  return std::fabs(a.x() - b.x()) < kSame && std::fabs(a.y() - b.y()) < kSame && std::fabs(a.z() - b.z()) < kSame;
}

// Vertices of one point that share a normal: where one of them is, and the sum of their polygons' areas.
struct Fan {
  UT_Vector3 before;
  double sum[3];
};

void push_vertex_normals(GU_Detail &detail, const std::vector<double> &points, const GA_RWHandleV3 &normal) {
  std::vector<std::vector<Fan>> fans(points.size() / 3);
  const auto fan_of = [&](GA_Index point, const UT_Vector3 &before) -> Fan & {
    std::vector<Fan> &all = fans[static_cast<std::size_t>(point)];
    for (Fan &fan : all)
      if (is_near(fan.before, before)) return fan;
    all.push_back({before, {0, 0, 0}});
    return all.back();
  };
  std::vector<std::pair<GA_Offset, GA_Index>> vertices;
  for (GA_Iterator it(detail.getPrimitiveRange()); !it.atEnd(); ++it) {
    const GA_Primitive *polygon = detail.getPrimitive(*it);
    if (polygon->getTypeId().get() != GEO_PRIMPOLY) continue;
    double area[3];
    area_of(*polygon, points, area);
    for (GA_Size k = 0; k < polygon->getVertexCount(); ++k) {
      vertices.emplace_back(polygon->getVertexOffset(k), polygon->getPointIndex(k));
      Fan &fan = fan_of(vertices.back().second, normal.get(vertices.back().first));
      for (std::size_t i = 0; i < 3; ++i) fan.sum[i] += area[i];
    }
  }
  for (const auto &[vertex, point] : vertices) {
    const UT_Vector3 before = normal.get(vertex);
    normal.set(vertex, unit(fan_of(point, before).sum, before));
  }
  normal.bumpDataId();
}

}  // namespace

// By Newell's sum of a polygon, which weighs by area: quads and polygons need no triangles.
void push_normals(GU_Detail &detail) {
  const GA_RWHandleV3 of_points(&detail, GA_ATTRIB_POINT, "N"), of_vertices(&detail, GA_ATTRIB_VERTEX, "N");
  if (!of_points.isValid() && !of_vertices.isValid()) return;
  const std::vector<double> points = points_of(detail);
  if (of_vertices.isValid()) push_vertex_normals(detail, points, of_vertices);
  if (!of_points.isValid()) return;
  std::vector<double> sums(points.size());
  for (GA_Iterator it(detail.getPrimitiveRange()); !it.atEnd(); ++it) {
    const GA_Primitive *polygon = detail.getPrimitive(*it);
    if (polygon->getTypeId().get() != GEO_PRIMPOLY) continue;
    double area[3];
    area_of(*polygon, points, area);
    for (GA_Size k = 0; k < polygon->getVertexCount(); ++k)
      for (std::size_t i = 0; i < 3; ++i) sums[3 * static_cast<std::size_t>(polygon->getPointIndex(k)) + i] += area[i];
  }
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it)
    of_points.set(*it, unit(&sums[3 * std::size_t(index_of(detail, *it))], of_points.get(*it)));
  of_points.bumpDataId();
}
