#include "attribute_makers.hpp"

#include <maya/MFnCompoundAttribute.h>
#include <maya/MFnEnumAttribute.h>
#include <maya/MFnMatrixAttribute.h>

#include <string>

MStatus create_number(MObject &attribute, const char *name, const char *brief, double value, Range range) {
  MStatus status;
  MFnNumericAttribute fn;
  attribute = fn.create(name, brief, MFnNumericData::kDouble, value, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  fn.setKeyable(true);
  fn.setMin(range.least);
  fn.setSoftMax(range.soft_most);
  return MS::kSuccess;
}

MStatus create_plain(MObject &attribute, const char *name, const char *brief, MFnNumericData::Type type, double value) {
  MStatus status;
  MFnNumericAttribute fn;
  attribute = fn.create(name, brief, type, value, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  fn.setKeyable(true);
  return MS::kSuccess;
}

// Three numbers, whose names end on X, Y and Z, and x, y and z.
MStatus create_triple(MObject &attribute, std::initializer_list<MObject *> children, const char *name, const char *brief, const host::Vec3 &value) {
  MStatus status;
  std::size_t k = 0;
  for (MObject *child : children) {
    const std::string own = std::string(name) + "XYZ"[k], short_own = std::string(brief, 2) + "xyz"[k];
    status = create_plain(*child, own.c_str(), short_own.c_str(), MFnNumericData::kDouble, value[k++]);
    CHECK_MSTATUS_AND_RETURN_IT(status);
  }
  MFnNumericAttribute triple;
  attribute = triple.create(name, brief, **children.begin(), *children.begin()[1], *children.begin()[2], &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  triple.setKeyable(true);
  return MS::kSuccess;
}

// The first is the default.
MStatus create_choice(MObject &attribute, const char *name, const char *brief,
                      std::initializer_list<const char *> fields) {
  MStatus status;
  MFnEnumAttribute fn;
  attribute = fn.create(name, brief, 0, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  short number = 0;
  for (const char *field : fields) fn.addField(field, number++);
  fn.setKeyable(false);
  fn.setChannelBox(true);
  return MS::kSuccess;
}

MStatus create_matrix(MObject &attribute, const char *name, const char *brief) {
  MStatus status;
  MFnMatrixAttribute fn;
  attribute = fn.create(name, brief, MFnMatrixAttribute::kDouble, &status);
  return status;
}

// A painted map for each geometry: floats at vertices inside a list, as Maya's own weights.
MStatus create_painted(MObject &list, MObject &map, const char *const (&names)[4], float value, float most) {
  MStatus status;
  MFnNumericAttribute number;
  map = number.create(names[2], names[3], MFnNumericData::kFloat, value, &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  number.setMin(0);
  number.setMax(most);
  number.setArray(true);
  number.setUsesArrayDataBuilder(true);
  MFnCompoundAttribute compound;
  list = compound.create(names[0], names[1], &status);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  compound.addChild(map);
  compound.setArray(true);
  compound.setUsesArrayDataBuilder(true);
  return MS::kSuccess;
}
