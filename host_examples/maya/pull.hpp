// From Maya's data block into the glue's Request. What the user can mend is thrown as host::HostError.
#pragma once

#include "request.hpp"

#include <maya/MDataBlock.h>
#include <maya/MMatrix.h>
#include <maya/MObject.h>
#include <maya/MStatus.h>

host::Matrix4 matrix_of(const MMatrix &matrix);

MStatus pull_mesh(MDataBlock &block, const MObject &input, const MObject &inputGeom, unsigned int multiIndex,
                  host::Mesh &mesh);
MStatus pull_proxy(MDataBlock &block, host::Request &request);  // simulated in the mesh's place, which follows it
void pull_settings(MDataBlock &block, host::Request &request);
void pull_maps(MDataBlock &block, unsigned int multiIndex, host::Request &request);
// Directions by texture coordinates, creases and the rest shape; asks for the mesh.
MStatus pull_build(MDataBlock &block, const MObject &input, const MObject &inputGeom, unsigned int multiIndex, host::Request &request);
void pull_supports(MDataBlock &block, unsigned int multiIndex, host::Request &request);  // asks for the mesh
void pull_handles(MDataBlock &block, std::vector<host::Handle> &handles);
MStatus pull_colliders(MDataBlock &block, std::vector<host::Collider> &colliders);
