// shellWarp: a deformer that lets a mesh swing as a thin shell. docs/guide/maya.md has the attributes in an artist's words.
#pragma once

#include "shell_runner.hpp"

#include <maya/MDagModifier.h>
#include <maya/MDataBlock.h>
#include <maya/MDataHandle.h>
#include <maya/MItGeometry.h>
#include <maya/MMatrix.h>
#include <maya/MObject.h>
#include <maya/MPxDeformerNode.h>
#include <maya/MStatus.h>
#include <maya/MString.h>
#include <maya/MTypeId.h>
#include <maya/MTypes.h>
#if MAYA_API_VERSION >= 20200000
#include <maya/MEvaluationNode.h>
#include <maya/MNodeCacheDisablingInfo.h>
#include <maya/MNodeCacheSetupInfo.h>
#include <maya/MObjectArray.h>
#include <maya/MPlug.h>
#include <maya/MTimeRange.h>
#endif

#include <map>
#include <mutex>
#include <string>

class ShellWarpNode : public MPxDeformerNode {
public:
  static const char *const nodeName;
  static const MTypeId nodeId;

  static void *creator();
  static MStatus initialize();

  MStatus deform(MDataBlock &block, MItGeometry &points, const MMatrix &toWorld, unsigned int multiIndex) override;
  MStatus accessoryNodeSetup(MDagModifier &modifier) override;  // what `deformer` asks for: connects the clock

  // Beside other nodes: all that nodes share is constant. A node with itself waits for its mutex.
  SchedulingType schedulingType() const override { return kParallel; }
#if MAYA_API_VERSION >= 20200000
  // Cached Playback, as nodes of a simulation have it: frames are filled from the first on, and a change forgets all of them.
  void getCacheSetup(const MEvaluationNode &node, MNodeCacheDisablingInfo &disabling, MNodeCacheSetupInfo &setup,
                     MObjectArray &monitored) const override;
  MTimeRange transformInvalidationRange(const MPlug &source, const MTimeRange &input) const override;
#endif

  // What the user was told of last, of all geometries; empty where all is well. For any thread.
  std::string status() const;

  // Memory of models and frames, of all geometries.
  uint64_t bytes() const;

  // How far the frame that was shown last is off the full shell, a line for each geometry. Throws host::HostError.
  std::string certificate() const;

  // Writes the frames that were played to a file, of further geometries to FILE.1 and so on. Throws host::HostError.
  void write_cache(const std::string &file) const;

private:
  static MStatus addAttributes();

  // One geometry that the node deforms.
  struct Shell {
    host::ShellRunner runner;
    std::string told;    // what the user was told of last, without its numbers
    std::string status;  // with them
    std::string cache;   // the file that its frames were taken from
  };

  MStatus pull(MDataBlock &block, const MMatrix &toWorld, unsigned int multiIndex, host::Request &request) const;
  MStatus push(MDataBlock &block, MItGeometry &points, unsigned int multiIndex, float amount,
               const host::ShellRunner &runner);
  static void adopt(MDataBlock &block, unsigned int multiIndex, Shell &shell);
  void warn(Shell &shell) const;
  void fail(Shell &shell, const std::string &message) const;

  mutable std::mutex mutex_;  // background and foreground evaluation may meet
  std::map<unsigned int, Shell> shells_;

public:
  // The shell's clock
  static MObject time, startFrame, cache;
  // What pulls at it
  static MObject gravity, gravityX, gravityY, gravityZ;
  static MObject wind, windX, windY, windZ, airDensity, normalDrag, tangentialDrag;
  static MObject force, forceX, forceY, forceZ, forceMapList, forceMap, windMapList, windMap;
  // What it is made of
  static MObject stiffnessFrom, frequency, sag, thickness, kBend, kStretch, density;
  static MObject preset, young, poisson, volumeDensity;
  static MObject thicknessMapList, thicknessMap, youngMapList, youngMap, densityMapList, densityMap;
  static MObject bendMapList, bendMap, stretchMapList, stretchMap, growthMapList, growthMap;
  static MObject youngAcross, shear, direction, directionX, directionY, directionZ, directions;
  static MObject creases, creaseEdges, creaseFactor, creaseAngle, creaseSetsAngle, creaseYield, restShape;
  static MObject dampingRatio, dampingMass, dampingStiffness, dampingMapList, dampingMap, stiffnessFactor;
  static MObject method, reducedFields, autoError, correctionSteps, integrator;
  static MObject modes, doublePrecision, certify;
  // What holds it
  static MObject supportKind, supportComponents, supportWeightList, supportWeights, follow, followRest, supportFields;
  static MObject supportAxes, supportAxesComponents, supportAxisX, supportAxisY, supportAxisZ, supportAxesSymmetric;
  static MObject ties, tieVertex, tieTo, tieToFace, tieStiffness, tieWithin;
  static MObject frameFrom, supportFrame;
  // What is simulated in the deformed mesh's place
  static MObject proxy, proxyVertices, proxyThickness;
  // What leads it
  static MObject handles, handleVertex, handleTarget, handlePosition, handleOrientation, handleCompliance, handleHeld, handleAxisX, handleAxisY, handleAxisZ;
  // What it touches
  static MObject colliders, colliderMesh, colliderMatrix, colliderShape, colliderCells, colliderFriction,
      colliderThickness, colliderOneSided, colliderDepth;
  static MObject contactPatches, contactPatchesNear, contactPatchesMost, pushOut;
};
