#include "pull.hpp"

#include "blend.hpp"
#include "message.hpp"

#include <GA/GA_Handle.h>
#include <GA/GA_Iterator.h>
#include <GEO/GEO_PrimPoly.h>
#include <UT/UT_Quaternion.h>

#include <string>

namespace {

uint32_t index_of(const GU_Detail &detail, GA_Offset offset) {
  return static_cast<uint32_t>(detail.pointIndex(offset));
}

GA_ROHandleF float_attribute(const GU_Detail &detail, const UT_StringHolder &name) {
  const GA_ROHandleF handle(&detail, GA_ATTRIB_POINT, name);
  if (!handle.isValid()) throw host::HostError(std::string("there is no point attribute ") + name.c_str());
  return handle;
}

}  // namespace

void pull_mesh(const GU_Detail &detail, host::Mesh &mesh) {
  mesh.points.resize(3 * static_cast<std::size_t>(detail.getNumPoints()));
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it) {
    const UT_Vector3 x = detail.getPos3(*it);
    double *to = &mesh.points[3 * std::size_t(index_of(detail, *it))];
    to[0] = x.x(), to[1] = x.y(), to[2] = x.z();
  }
  for (GA_Iterator it(detail.getPrimitiveRange()); !it.atEnd(); ++it) {
    const GA_Primitive *primitive = detail.getPrimitive(*it);
    if (primitive->getTypeId().get() != GEO_PRIMPOLY || !static_cast<const GEO_PrimPoly *>(primitive)->isClosed())
      throw host::HostError("primitive " + host::number(uint64_t(detail.primitiveIndex(*it))) +
                            " is no closed polygon; convert it, or delete it before the shell");
    for (GA_Size k = 2; k < primitive->getVertexCount(); ++k)
      for (const GA_Size corner : {GA_Size(0), k - 1, k})
        mesh.triangles.push_back(static_cast<uint32_t>(primitive->getPointIndex(corner)));
  }
}

void pull_supports(const GU_Detail &detail, const UT_StringHolder &group, const UT_StringHolder &attribute,
                   std::vector<uint32_t> &held) {
  const GA_PointGroup *members = nullptr;
  if (group.isstring()) {
    members = detail.findPointGroup(group);
    if (!members) throw host::HostError(std::string("there is no point group ") + group.c_str());
  }
  GA_ROHandleF painted;
  if (attribute.isstring()) painted = float_attribute(detail, attribute);
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it)
    if ((members && members->containsOffset(*it)) || (painted.isValid() && painted.get(*it) >= 0.5f))
      held.push_back(index_of(detail, *it));
}

void pull_handles(const GU_Detail &points, std::vector<host::Handle> &handles) {
  const GA_ROHandleI vertex(&points, GA_ATTRIB_POINT, "shellpoint"), position(&points, GA_ATTRIB_POINT, "holdposition"),
      orientation(&points, GA_ATTRIB_POINT, "holdorientation");
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
    handles.push_back(handle);
  }
}

void push(GU_Detail &detail, const host::ShellRunner &runner, double envelope, const UT_StringHolder &weights) {
  GA_ROHandleF weight;
  if (weights.isstring()) weight = float_attribute(detail, weights);
  for (GA_Iterator it(detail.getPointRange()); !it.atEnd(); ++it) {
    const std::size_t at = 3 * std::size_t(index_of(detail, *it));
    const UT_Vector3 x = detail.getPos3(*it);
    const double in[3] = {x.x(), x.y(), x.z()};
    double out[3];
    const double share = weight.isValid() ? envelope * static_cast<double>(weight.get(*it)) : envelope;
    host::blend_point(out, in, &runner.rest()[at], &runner.deformed()[at], share);
    detail.setPos3(*it, UT_Vector3(static_cast<float>(out[0]), static_cast<float>(out[1]), static_cast<float>(out[2])));
  }
  detail.getP()->bumpDataId();
}
