#include "shell_warp_node.hpp"

#include "blend.hpp"
#include "host_interrupt.hpp"
#include "notice.hpp"
#include "pull.hpp"

#include <maya/MFnDependencyNode.h>
#include <maya/MPoint.h>
#include <maya/MPointArray.h>
#include <maya/MSelectionList.h>

#include <exception>
#include <utility>

const char *const ShellWarpNode::nodeName = "shellWarp";
// From the block that Autodesk leaves to plug-ins that are not published; a studio puts one of its own here.
const MTypeId ShellWarpNode::nodeId(0x0007F5A1);

// Maya's internal unit of length is the centimetre, whatever its interface shows.
static constexpr double kMetresPerUnit = 0.01;

void *ShellWarpNode::creator() { return new ShellWarpNode; }

MStatus ShellWarpNode::accessoryNodeSetup(MDagModifier &modifier) {
  MSelectionList found;
  MObject clock;
  if (found.add("time1") != MS::kSuccess || found.getDependNode(0, clock) != MS::kSuccess) return MS::kSuccess;
  return modifier.connect(clock, MFnDependencyNode(clock).attribute("outTime"), thisMObject(), time);
}

#if MAYA_API_VERSION >= 20200000

void ShellWarpNode::getCacheSetup(const MEvaluationNode &node, MNodeCacheDisablingInfo &disabling,
                                  MNodeCacheSetupInfo &setup, MObjectArray &monitored) const {
  MPxDeformerNode::getCacheSetup(node, disabling, setup, monitored);
  setup.setRequirement(MNodeCacheSetupInfo::kSimulationSupport, true);
}

// A frame rests on all before it, and Maya is told so without asking for values: this is called while they change. The base's is not
// to be called.
MTimeRange ShellWarpNode::transformInvalidationRange(const MPlug &, const MTimeRange &input) const {
  if (input.empty()) return input;
  const MTime always(1e9, MTime::kSeconds);  // 31 years; Maya's ticks reach 65e9 s
  const MTime never(-1e9, MTime::kSeconds);
  return input | MTimeRange(never, always);
}

#endif

std::string ShellWarpNode::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::string lines;
  for (const auto &[index, shell] : shells_)
    if (!shell.status.empty()) lines += (lines.empty() ? "" : "\n") + shell.status;
  return lines;
}

uint64_t ShellWarpNode::bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  uint64_t sum = 0;
  for (const auto &[index, shell] : shells_) sum += shell.runner.bytes();
  return sum;
}

std::string ShellWarpNode::certificate() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (shells_.empty()) throw host::HostError("there are no frames yet: play from the start frame");
  std::string lines;
  HostInterrupt interrupt("estimating the error");
  for (const auto &[index, shell] : shells_)
    lines += (lines.empty() ? "" : "\n") + shell.runner.certificate([&interrupt] { return interrupt.requested(); });
  return lines;
}

static std::string cache_of(const std::string &file, unsigned int multiIndex) {
  return multiIndex == 0 ? file : file + "." + std::to_string(multiIndex);
}

void ShellWarpNode::write_cache(const std::string &file) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (shells_.empty()) throw host::HostError("there are no frames yet: play from the start frame");
  for (const auto &[index, shell] : shells_) host::write_frames(cache_of(file, index), shell.runner.frames());
}

// Reads a file when its name is new. One that cannot be read is an error at every frame: a shell that moved otherwise would be worse.
void ShellWarpNode::adopt(MDataBlock &block, unsigned int multiIndex, Shell &shell) {
  const MString name = block.inputValue(cache).asString();
  const std::string file = name.length() ? cache_of(name.asChar(), multiIndex) : "";
  if (file == shell.cache) return;
  if (!file.empty()) shell.runner.adopt(host::read_frames(file));
  shell.cache = file;
}

MStatus ShellWarpNode::deform(MDataBlock &block, MItGeometry &points, const MMatrix &toWorld, unsigned int multiIndex) {
  MStatus status;
  const float amount = block.inputValue(envelope, &status).asFloat();
  CHECK_MSTATUS_AND_RETURN_IT(status);
  if (amount == 0.0f) return MS::kSuccess;

  const std::lock_guard<std::mutex> lock(mutex_);
  Shell &shell = shells_[multiIndex];
  try {
    host::Request request;
    HostInterrupt interrupt("stepping through frames");
    request.interrupted = [&interrupt] { return interrupt.requested(); };
    request.progress = [&interrupt](uint32_t phase, double fraction) { interrupt.show(phase, fraction); };
    status = pull(block, toWorld, multiIndex, request);
    CHECK_MSTATUS_AND_RETURN_IT(status);
    adopt(block, multiIndex, shell);
    shell.runner.evaluate(std::move(request));
    status = push(block, points, multiIndex, amount, shell.runner);
    CHECK_MSTATUS_AND_RETURN_IT(status);
    warn(shell);
    return MS::kSuccess;
  } catch (const std::exception &error) {
    fail(shell, error.what());
  } catch (...) {
    fail(shell, "an unknown error");
  }
  return MS::kFailure;  // Maya shows the geometry as it came in
}

MStatus ShellWarpNode::pull(MDataBlock &block, const MMatrix &toWorld, unsigned int multiIndex,
                            host::Request &request) const {
  MStatus status = pull_mesh(block, input, inputGeom, multiIndex, request.mesh);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  status = pull_proxy(block, request);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  pull_settings(block, request);
  pull_maps(block, multiIndex, request);
  status = pull_build(block, input, inputGeom, multiIndex, request);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  pull_supports(block, multiIndex, request);
  request.inputs.object = host::pose_of(matrix_of(toWorld), "the deformed object's transform", host::Scale::even);
  const bool own = block.inputValue(frameFrom).asShort() == 0;
  request.follow &= own;  // supportFrame says by itself how they move
  request.inputs.frame =
      own ? request.inputs.object
          : host::pose_of(matrix_of(block.inputValue(supportFrame).asMatrix()), "supportFrame", host::Scale::even);
  request.build.stiffness.metres = kMetresPerUnit * request.inputs.object.scale;
  pull_handles(block, request.inputs.handles);
  return pull_colliders(block, request.inputs.colliders);
}

// Only the members of the deformer's set come with the iterator; the shell is the whole mesh.
MStatus ShellWarpNode::push(MDataBlock &block, MItGeometry &points, unsigned int multiIndex, float amount,
                            const host::ShellRunner &runner) {
  MPointArray positions;
  const MStatus status = points.allPositions(positions);
  CHECK_MSTATUS_AND_RETURN_IT(status);
  for (unsigned int k = 0; !points.isDone() && k < positions.length(); points.next(), ++k) {
    const int vertex = points.index();
    const std::size_t at = 3 * static_cast<std::size_t>(vertex);
    if (vertex < 0 || at >= runner.rest().size()) return MS::kFailure;
    const double share = static_cast<double>(amount) *
                         static_cast<double>(weightValue(block, multiIndex, static_cast<unsigned int>(vertex)));
    MPoint &point = positions[k];
    const double in[3] = {point.x, point.y, point.z};
    double out[3];
    host::blend_point(out, in, runner.replaces() ? in : &runner.rest()[at], &runner.deformed()[at], share);
    point.x = out[0];
    point.y = out[1];
    point.z = out[2];
  }
  return points.setAllPositions(positions);
}

// Both tell once for each change, not at every frame.
void ShellWarpNode::warn(Shell &shell) const {
  const host::Notes &notes = shell.runner.notes();
  shell.status = notes.warning();
  const std::string what = host::number(uint64_t(notes.warnings())) + notes.certified;
  if (what == shell.told) return;
  shell.told = what;
  if (notes.warnings()) notice::warning(std::string(name().asChar()) + ": " + notes.warning());
}

void ShellWarpNode::fail(Shell &shell, const std::string &message) const {
  shell.status = message;
  if (message == shell.told) return;
  shell.told = message;
  notice::error(std::string(name().asChar()) + ": " + message);
}
