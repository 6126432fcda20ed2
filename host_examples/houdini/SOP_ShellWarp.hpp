// ShellWarp: a SOP that lets polygons swing as a thin shell. docs/guide/houdini.md has the parameters in an artist's words.
#pragma once

#include <SOP/SOP_Node.h>
#include <UT/UT_StringHolder.h>

class PRM_Template;

class SOP_ShellWarp : public SOP_Node {
public:
  static const UT_StringHolder theSOPTypeName;
  static PRM_Template *buildTemplates();
  static OP_Node *myConstructor(OP_Network *network, const char *name, OP_Operator *op);

  const SOP_NodeVerb *cookVerb() const override;

protected:
  SOP_ShellWarp(OP_Network *network, const char *name, OP_Operator *op);
  OP_ERROR cookMySop(OP_Context &context) override { return cookMyselfAsVerb(context); }
  const char *inputLabel(unsigned index) const override;
};
