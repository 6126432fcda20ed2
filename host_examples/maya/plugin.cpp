// What Maya calls when it loads and unloads the plug-in.
#include "notice.hpp"
#include "shell_warp_command.hpp"
#include "shell_warp_node.hpp"

#include <maya/MFnPlugin.h>

#if defined(_WIN32)
#define SHELLWARP_PLUGIN_EXPORT  // the linker is told by name: see CMakeLists.txt
#else
#define SHELLWARP_PLUGIN_EXPORT __attribute__((visibility("default")))
#endif

SHELLWARP_PLUGIN_EXPORT MStatus initializePlugin(MObject object) {
  notice::start();
  MFnPlugin plugin(object, "shellwarp", sw_version_string(), "Any");
  MStatus status = plugin.registerNode(ShellWarpNode::nodeName, ShellWarpNode::nodeId, ShellWarpNode::creator,
                                       ShellWarpNode::initialize, MPxNode::kDeformerNode);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = plugin.registerCommand("shellWarp", ShellWarpCommand::creator, ShellWarpCommand::syntax_of);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  // Procedures of the module's scripts: the menu. Where they are missing, the node and the command are there all the same.
  return plugin.registerUI("shellWarpCreateUI", "shellWarpDeleteUI");
}

SHELLWARP_PLUGIN_EXPORT MStatus uninitializePlugin(MObject object) {
  MFnPlugin plugin(object);
  const MStatus status = plugin.deregisterCommand("shellWarp");
  CHECK_MSTATUS_AND_RETURN_IT(status);
  sw_set_threads(1);  // the library's threads end before it is unloaded
  return plugin.deregisterNode(ShellWarpNode::nodeId);
}
