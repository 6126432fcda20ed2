// What an MObject points to in the stand-in.
#pragma once

#include "fake_graph.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace fake {

struct Object {
  explicit Object(MFn::Type kind) : fn(kind) {}
  virtual ~Object() = default;
  MFn::Type fn;

  template <class T>
  static T *get(const MObject &object) {
    return dynamic_cast<T *>(object.object_.get());
  }
  static MObject wrap(std::shared_ptr<Object> object) {
    MObject out;
    out.object_ = std::move(object);
    return out;
  }
};

// A node of the scene, by its name.
struct NodeObject : Object {
  NodeObject(MFn::Type kind, std::string n) : Object(kind), name(std::move(n)) {}
  std::string name;
};

MObject component_of(MFn::Type kind, const std::vector<int> &elements);
std::string attribute_name(const MObject &attribute);

}  // namespace fake
