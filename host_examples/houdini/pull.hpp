// Between Houdini's geometry and the glue. What the user can mend is thrown as host::HostError. Vertices of the glue are points
// here, by their index (what the spreadsheet shows), not by their offset.
#pragma once

#include "shell_runner.hpp"

#include <GU/GU_Detail.h>
#include <UT/UT_StringHolder.h>

#include <cstddef>
#include <cstdint>
#include <vector>

// `starts`: where the corners of each primitive begin, and an end.
void pull_mesh(const GU_Detail &detail, host::Mesh &mesh, std::vector<std::size_t> *starts = nullptr);
std::vector<double> points_of(const GU_Detail &detail);  // n x 3
// A float attribute of points as factors; none where it is not named.
void pull_map(const GU_Detail &detail, const UT_StringHolder &attribute, std::vector<double> &factors);

std::vector<double> pull_vectors(const GU_Detail &detail, const UT_StringHolder &attribute);  // of points, n x 3
// Of each polygon, by an attribute of primitives or the mean of one of points.
void pull_directions(const GU_Detail &detail, const UT_StringHolder &attribute, host::Stiffness &stiffness);
// Every edge of a group as `common`, whose angles are in degrees and convex as Houdini shows polygons. Where points have f@creasefactor,
// f@creaseangle or f@creaseyield, the mean of an edge's two goes over it.
void pull_edges(const GU_Detail &detail, const UT_StringHolder &group, const host::Crease &common, std::vector<host::Crease> &creases);

// `group` is a pattern, as in every node: names, wildcards, numbers; none where it is empty.
void pull_group(const GU_Detail &detail, const UT_StringHolder &group, std::vector<uint32_t> &points);
// Of such a group, and from 0.5 on of an attribute.
void pull_supports(const GU_Detail &detail, const UT_StringHolder &group, const UT_StringHolder &attribute,
                   std::vector<uint32_t> &held);

// An integer of points: axes x, y and z as 1, 2 and 4 added, 0 for none.
void pull_axes(const GU_Detail &detail, const UT_StringHolder &attribute, std::vector<host::AxisSupport> &supports);
// An integer of points: what each is tied to, a point or a primitive, below 0 for none.
void pull_ties(const GU_Detail &detail, const UT_StringHolder &attribute, bool to_face, double stiffness, std::vector<host::Tie> &ties);

// Closed polygons with the settings of `common`: one solid, or where `pieces` names an attribute of primitives, an integer or a text, one for
// each of its values. Of a piece s@collidershape, i@collidercells, f@colliderfriction, f@colliderthickness, i@collideronesided and f@colliderdepth go over the settings.
std::vector<host::Collider> pull_colliders(const GU_Detail &polygons, const UT_StringHolder &pieces, const host::Collider &common);

// A point for each handle: i@shellpoint the point held, P its target, p@orient its orientation, i@holdposition (1),
// i@holdorientation (0), f@compliance (0); in brackets what holds where the attribute is missing.
void pull_handles(const GU_Detail &points, std::vector<host::Handle> &handles);

// Writes P, and v where the runner has velocities. `weights` names a point attribute, or is empty.
void push(GU_Detail &detail, const host::ShellRunner &runner, double envelope, const UT_StringHolder &weights);
// Where points or vertices have N: of the polygons as they are now. Vertices of a point that came in with the same N stay smooth, and others
// keep their edge.
void push_normals(GU_Detail &detail);
