// What of a request cannot be: each throws HostError naming the value or what does not go together.
#pragma once

#include "request.hpp"

namespace host {

void check_motion(const Request &request);
void check_output(const Request &request);   // what is done to a frame before it is shown
void check_place(const Request &request);    // what is of a mesh that another stands for
void check_wind(const Request &request);
void check_forces(const Request &request);
void check_handles(const Request &request);

}  // namespace host
