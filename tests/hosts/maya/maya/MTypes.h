#define MAYA_API_VERSION 20240000
#include "../fake_maya.hpp"
