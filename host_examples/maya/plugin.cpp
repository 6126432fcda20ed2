// What Maya calls when it loads and unloads the plug-in.
#include "shell_warp_node.hpp"

#include <maya/MFnPlugin.h>

#if defined(_WIN32)
#define SHELLWARP_PLUGIN_EXPORT  // the linker is told by name: see CMakeLists.txt
#else
#define SHELLWARP_PLUGIN_EXPORT __attribute__((visibility("default")))
#endif

SHELLWARP_PLUGIN_EXPORT MStatus initializePlugin(MObject object) {
  MFnPlugin plugin(object, "shellwarp", sw_version_string(), "Any");
  return plugin.registerNode(ShellWarpNode::nodeName, ShellWarpNode::nodeId, ShellWarpNode::creator,
                             ShellWarpNode::initialize, MPxNode::kDeformerNode);
}

SHELLWARP_PLUGIN_EXPORT MStatus uninitializePlugin(MObject object) {
  MFnPlugin plugin(object);
  return plugin.deregisterNode(ShellWarpNode::nodeId);
}
