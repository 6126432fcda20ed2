#include "../fake_maya.hpp"
