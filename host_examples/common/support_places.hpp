// Where the input's animation has what holds the shell.
#pragma once

#include "message.hpp"
#include "request.hpp"

#include <cstdint>
#include <vector>

namespace host {

// Supports have left the rigid motion of all, and the state cannot follow.
class Apart : public HostError {
public:
  using HostError::HostError;
};

// Vertices and those that share a triangle with one, ascending.
std::vector<uint32_t> with_neighbours(const std::vector<uint32_t> &triangles, const std::vector<uint32_t> &vertices);

// Of held vertices, those that no triangle of held ones alone has: what holds their slope, too, is their neighbours.
std::vector<uint32_t> alone_of(const std::vector<uint32_t> &triangles, const std::vector<uint32_t> &held);

// The supports whose neighbours are held with them. On a proxy by the paper's constants the neighbours on the mesh that it stands for are supports already, as a row of
// the proxy's edges is far wider; and only those that are alone need more.
std::vector<uint32_t> held_with_neighbours(const Mesh &mesh, const Build &build);

class SupportPlaces {
public:
  // Of a new model: the vertices that its supports may hold, clamped ones with their neighbours.
  void prepare(const Mesh &mesh, const Build &build);

  const std::vector<uint32_t> &vertices() const { return vertices_; }  // ascending

  // Their places in `points` (3 each, object's axes); none where all of them are as at `rest`. What is clamped only as a neighbour, and is
  // left at rest while what it belongs to moves, goes along.
  std::vector<double> read(const std::vector<double> &points, const std::vector<double> &rest) const;

private:
  struct Neighbour {
    std::size_t at;                  // in vertices_
    std::vector<uint32_t> supports;  // that share an edge with it
    std::size_t group;
  };

  std::vector<uint32_t> vertices_;
  std::vector<std::vector<uint32_t>> groups_;  // of supports that edges join
  std::vector<Neighbour> neighbours_;
};

}  // namespace host
