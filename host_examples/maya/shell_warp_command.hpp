// shellWarp, the command: makes shells, handles, colliders, contact patches, creases, ties and supports along axes of what is selected, each in one step of undo.
#pragma once

#include <maya/MArgList.h>
#include <maya/MDGModifier.h>
#include <maya/MPxCommand.h>
#include <maya/MSelectionList.h>
#include <maya/MStatus.h>
#include <maya/MString.h>
#include <maya/MSyntax.h>

#include <functional>
#include <string>
#include <vector>

class ShellWarpNode;

class ShellWarpCommand : public MPxCommand {
public:
  static void *creator();
  static MSyntax syntax_of();

  MStatus doIt(const MArgList &arguments) override;
  MStatus redoIt() override;
  MStatus undoIt() override;
  bool isUndoable() const override { return changes_; }
  bool hasSyntax() const override { return true; }

private:
  void create(const MSelectionList &selected);
  void add_handles(const MSelectionList &selected);
  void add_colliders(const MSelectionList &selected);
  void add_creases(const MSelectionList &selected);
  void hold_along(const MSelectionList &selected, const std::string &axes, bool symmetric);
  void tie(const MSelectionList &selected);
  void set_patches(const MSelectionList &selected);
  void certify(const MSelectionList &selected);
  void write_cache(const MSelectionList &selected, const std::string &file);
  void tell(const std::function<std::string(const ShellWarpNode &)> &what);
  void set_list(const std::string &plug, const char *kind, const std::vector<int> &components);
  void run(const std::string &mel);  // when the command is done, and again when it is redone

  MDGModifier modifier_;
  bool changes_ = false;
};
