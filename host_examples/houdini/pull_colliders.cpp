#include "pull.hpp"

#include "message.hpp"

#include <GA/GA_Handle.h>
#include <GA/GA_Iterator.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <string>

namespace {

constexpr const char *kShapes[] = {"plane", "sphere", "capsule", "box", "hull", "mesh", "deforming"};

uint32_t shape_of(const std::string &name) {
  std::string names;
  for (uint32_t k = 0; k < std::size(kShapes); ++k) {
    if (name == kShapes[k]) return SW_COLLIDER_PLANE + k;
    names += (k ? ", " : "") + std::string(kShapes[k]);
  }
  throw host::HostError("there is no shape '" + name + "'; there are " + names);
}

// Houdini's polygons run clockwise, seen from outside; a collider's run counterclockwise.
void turn_polygons(host::Mesh &mesh) {
  auto at = mesh.corners.begin();
  for (const uint32_t size : mesh.sizes) {
    std::reverse(at, at + size);
    at += size;
  }
}

// The polygons of each piece, by the value of the attribute.
std::map<std::string, std::vector<GA_Offset>> pieces_of(const GU_Detail &polygons, const UT_StringHolder &pieces) {
  const GA_ROHandleS texts(&polygons, GA_ATTRIB_PRIMITIVE, pieces);
  const GA_ROHandleI numbers(&polygons, GA_ATTRIB_PRIMITIVE, pieces);
  if (!texts.isValid() && !numbers.isValid())
    throw host::HostError(std::string("the colliders' primitives have no text or integer ") + pieces.c_str());
  std::map<std::string, std::vector<GA_Offset>> found;
  for (GA_Iterator it(polygons.getPrimitiveRange()); !it.atEnd(); ++it) {
    const char *text = texts.isValid() ? texts.get(*it) : nullptr;
    found[texts.isValid() ? (text ? text : "") : std::to_string(numbers.get(*it))].push_back(*it);
  }
  return found;
}

// Its polygons, with the points that they have alone.
void take_piece(const host::Mesh &all, const std::vector<std::size_t> &starts, const GU_Detail &polygons, const std::vector<GA_Offset> &members,
                host::Mesh &mesh) {
  std::map<uint32_t, uint32_t> own;
  for (const GA_Offset offset : members) {
    const std::size_t at = static_cast<std::size_t>(polygons.primitiveIndex(offset));
    const std::size_t n = starts[at + 1] - starts[at];
    if (n == 0) continue;
    mesh.sizes.push_back(static_cast<uint32_t>(n));
    for (std::size_t k = starts[at]; k < starts[at + 1]; ++k) {
      const auto [known, is_new] = own.emplace(all.corners[k], mesh.n_points());
      if (is_new)
        for (std::size_t c = 0; c < 3; ++c) mesh.points.push_back(all.points[3 * std::size_t{all.corners[k]} + c]);
      mesh.corners.push_back(known->second);
    }
  }
}

void read_piece(const GU_Detail &polygons, GA_Offset first, host::Collider &collider) {
  const GA_ROHandleS shape(&polygons, GA_ATTRIB_PRIMITIVE, "collidershape");
  const GA_ROHandleI cells(&polygons, GA_ATTRIB_PRIMITIVE, "collidercells");
  const GA_ROHandleF friction(&polygons, GA_ATTRIB_PRIMITIVE, "colliderfriction"), thickness(&polygons, GA_ATTRIB_PRIMITIVE, "colliderthickness");
  const GA_ROHandleI one_sided(&polygons, GA_ATTRIB_PRIMITIVE, "collideronesided");
  const GA_ROHandleF depth(&polygons, GA_ATTRIB_PRIMITIVE, "colliderdepth");
  if (shape.isValid() && shape.get(first) && *shape.get(first)) collider.kind = shape_of(shape.get(first));
  if (cells.isValid()) collider.cells = static_cast<uint32_t>(std::max(cells.get(first), 0));
  if (friction.isValid()) collider.friction = static_cast<double>(friction.get(first));
  if (thickness.isValid()) collider.thickness = static_cast<double>(thickness.get(first));
  if (one_sided.isValid()) collider.one_sided = one_sided.get(first) != 0;
  if (depth.isValid()) collider.depth = static_cast<double>(depth.get(first));
}

}  // namespace

std::vector<host::Collider> pull_colliders(const GU_Detail &polygons, const UT_StringHolder &pieces, const host::Collider &common) {
  std::vector<host::Collider> colliders;
  host::Mesh all;
  std::vector<std::size_t> starts;
  try {
    pull_mesh(polygons, all, &starts);
    turn_polygons(all);
    if (!pieces.isstring()) {
      colliders.push_back(common);
      colliders.back().mesh = std::move(all);
      return colliders;
    }
  } catch (const host::HostError &error) {
    throw host::HostError(common.name + ": " + error.what());
  }
  for (const auto &[name, members] : pieces_of(polygons, pieces)) {
    host::Collider &piece = colliders.emplace_back(common);
    piece.name = "the collider " + name;
    try {
      read_piece(polygons, members.front(), piece);
    } catch (const host::HostError &error) {
      throw host::HostError(piece.name + ": " + error.what());
    }
    take_piece(all, starts, polygons, members, piece.mesh);
  }
  return colliders;
}
