// Envelope and painted weights: what a deformer does with the shell's displacement.
//
//   out_i = in_i + envelope weight_i (deformed_i - rest_i)
//
// in is what comes into the deformer now, rest the shape that the shell was made of. The two differ where something upstream
// moves the points; the shell's motion then rides on top.
#pragma once

#include <cstddef>

namespace host {

// One point; all are 3 coordinates of any floating-point type.
template <class Out, class In>
void blend_point(Out &out, const In &in, const double *rest, const double *deformed, double amount) {
  for (int k = 0; k < 3; ++k) out[k] = in[k] + amount * (deformed[k] - rest[k]);
}

}  // namespace host
