#include "../fake_houdini.hpp"
