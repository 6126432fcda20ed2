// A mesh that is simulated in the place of the host's, which follows it.
#pragma once

#include "request.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace host {

class ProxyMaker {
public:
  // Puts a proxy of the request's mesh into its place where one is asked for, and the mesh's own points into `drawn`. It is made once, and `anew`, at the start, where the
  // points have changed; else they lead it. Throws shellwarp::Error with the place and what to do, Interrupted where the user stops it.
  void take_place(Request &request, bool anew);

private:
  void make(const Request &request, const std::vector<uint32_t> &triangles);

  uint64_t key_ = 0;
  std::vector<double> rest_;       // the host's points that it was made of
  std::vector<double> points_;     // its own then
  std::vector<uint32_t> triangles_, sources_;
  std::vector<double> weights_;
  std::vector<uint32_t> held_;     // the host's vertices that are held, with the neighbours that hold their slope
  std::shared_ptr<const shellwarp::Proxy> proxy_;
};

}  // namespace host
