#include "skeleton.hpp"

#include <algorithm>

namespace cli {

namespace {

void write_bone(OutputFile &file, const Bone &bone, double seconds) {
  const SwFrameDesc pose = bone.motion->pose(seconds);
  const std::array<double, 3> joint = transform(pose, bone.motion->pivot);
  file.print(",%s,%s,%.9g,%.9g,%.9g", bone.name.c_str(), bone.parent.c_str(), joint[0], joint[1], joint[2]);
  for (std::size_t column = 0; column < 3; ++column)
    for (std::size_t row = 0; row < 3; ++row) file.print(",%.9g", pose.rotation[3 * row + column]);
  file.print("\n");
}

}  // namespace

const Bone *find_bone(const Skeleton &skeleton, const std::string &name) {
  const auto found =
      std::find_if(skeleton.begin(), skeleton.end(), [&](const Bone &bone) { return bone.name == name; });
  return found == skeleton.end() ? nullptr : &*found;
}

void write_bones(OutputFolder &folder, const std::string &name, const Skeleton &skeleton, uint32_t n_frames,
                 double frame_rate) {
  OutputFile file(folder, name);
  file.print("frame,time,bone,parent,x,y,z,xx,xy,xz,yx,yy,yz,zx,zy,zz\n");
  for (uint32_t frame = 0; frame <= n_frames; ++frame)
    for (const Bone &bone : skeleton) {
      const double seconds = frame / frame_rate;
      file.print("%u,%.9g", frame, seconds);
      write_bone(file, bone, seconds);
    }
  file.close();
}

}  // namespace cli
