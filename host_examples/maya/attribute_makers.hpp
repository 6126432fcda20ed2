// Attributes of the kinds that a shellWarp has, in a line each.
#pragma once

#include "pose.hpp"

#include <maya/MFnNumericAttribute.h>
#include <maya/MObject.h>
#include <maya/MStatus.h>

#include <initializer_list>

struct Range {
  double least, soft_most;
};

MStatus create_number(MObject &attribute, const char *name, const char *brief, double value, Range range);
MStatus create_plain(MObject &attribute, const char *name, const char *brief, MFnNumericData::Type type, double value);
MStatus create_triple(MObject &attribute, std::initializer_list<MObject *> children, const char *name, const char *brief, const host::Vec3 &value);
MStatus create_choice(MObject &attribute, const char *name, const char *brief, std::initializer_list<const char *> fields);
MStatus create_matrix(MObject &attribute, const char *name, const char *brief);
MStatus create_painted(MObject &list, MObject &map, const char *const (&names)[4], float value, float most);
