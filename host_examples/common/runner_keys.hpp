// What a run and its frames depend on, as numbers.
#pragma once

#include "request.hpp"

#include <cstdint>

namespace host {

// Of all that belongs to a whole run. The number of colliders belongs to the run: a saved state has a place for each.
uint64_t key_of(const Request &request);

// Of what acts at one evaluation.
uint64_t key_of(const Inputs &inputs);

}  // namespace host
