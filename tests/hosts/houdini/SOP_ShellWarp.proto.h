// Stands for the header that Houdini's generator writes from the dialog script in SOP_ShellWarp.cpp: an accessor for each
// parameter, "get" and the name with a capital. Menus come as enumerations there; the SOP casts them to int either way. That the
// names and types here are the script's is checked when a node is cooked.
#pragma once

#include "fake_houdini.hpp"

#include <stdexcept>

class SOP_ShellWarpParms : public SOP_NodeParms {
public:
  fpreal getTime() const { return time_; }
  fpreal getStartframe() const { return startframe_; }
  fpreal getFramerate() const { return framerate_; }
  UT_Vector3D getGravity() const { return gravity_; }
  UT_Vector3D getWind() const { return wind_; }
  fpreal getAirdensity() const { return airdensity_; }
  fpreal getNormaldrag() const { return normaldrag_; }
  fpreal getTangentialdrag() const { return tangentialdrag_; }
  int64_t getStiffnessfrom() const { return stiffnessfrom_; }
  fpreal getFrequency() const { return frequency_; }
  fpreal getSag() const { return sag_; }
  fpreal getThickness() const { return thickness_; }
  fpreal getKbend() const { return kbend_; }
  fpreal getKstretch() const { return kstretch_; }
  fpreal getDensity() const { return density_; }
  fpreal getDampingratio() const { return dampingratio_; }
  fpreal getDampingmass() const { return dampingmass_; }
  fpreal getDampingstiffness() const { return dampingstiffness_; }
  int64_t getModes() const { return modes_; }
  bool getDoubleprecision() const { return doubleprecision_; }
  bool getCertify() const { return certify_; }
  const UT_StringHolder &getMethod() const { return method_; }
  int64_t getReducedfields() const { return reducedfields_; }
  fpreal getAutoerror() const { return autoerror_; }
  int64_t getCorrectionsteps() const { return correctionsteps_; }
  int64_t getIntegrator() const { return integrator_; }
  bool getFollow() const { return follow_; }
  int64_t getSupportfields() const { return supportfields_; }
  int64_t getProxyvertices() const { return proxyvertices_; }
  fpreal getProxythickness() const { return proxythickness_; }
  int64_t getSupportkind() const { return supportkind_; }
  const UT_StringHolder &getSupportgroup() const { return supportgroup_; }
  const UT_StringHolder &getSupportattrib() const { return supportattrib_; }
  UT_Vector3D getFramet() const { return framet_; }
  UT_Vector3D getFramer() const { return framer_; }
  const UT_StringHolder &getPreset() const { return preset_; }
  fpreal getYoung() const { return young_; }
  fpreal getPoisson() const { return poisson_; }
  fpreal getVolumedensity() const { return volumedensity_; }
  UT_StringHolder getThicknessmap() const { return thicknessmap_; }
  UT_StringHolder getYoungmap() const { return youngmap_; }
  UT_StringHolder getDensitymap() const { return densitymap_; }
  UT_StringHolder getBendmap() const { return bendmap_; }
  UT_StringHolder getStretchmap() const { return stretchmap_; }
  UT_StringHolder getGrowthmap() const { return growthmap_; }
  fpreal getMetresperunit() const { return metresperunit_; }
  int64_t getCollidershape() const { return collidershape_; }
  int64_t getCollidercells() const { return collidercells_; }
  fpreal getColliderfriction() const { return colliderfriction_; }
  fpreal getColliderthickness() const { return colliderthickness_; }
  bool getCollideronesided() const { return collideronesided_; }
  fpreal getColliderdepth() const { return colliderdepth_; }
  UT_Vector3D getCollidert() const { return collidert_; }
  UT_Vector3D getColliderr() const { return colliderr_; }
  fpreal getEnvelope() const { return envelope_; }
  bool getVelocity() const { return velocity_; }
  const UT_StringHolder &getWeightattrib() const { return weightattrib_; }
  const UT_StringHolder &getContactpatches() const { return contactpatches_; }
  double getContactpatchesnear() const { return contactpatchesnear_; }
  int64_t getContactpatchesmost() const { return contactpatchesmost_; }
  bool getPushout() const { return pushout_; }
  const UT_StringHolder &getColliderpieces() const { return colliderpieces_; }
  const UT_StringHolder &getDampingmap() const { return dampingmap_; }
  fpreal getStiffnessfactor() const { return stiffnessfactor_; }
  fpreal getYoungacross() const { return youngacross_; }
  fpreal getShear() const { return shear_; }
  UT_Vector3D getDirection() const { return direction_; }
  const UT_StringHolder &getDirections() const { return directions_; }
  const UT_StringHolder &getRestshape() const { return restshape_; }
  const UT_StringHolder &getCreasegroup() const { return creasegroup_; }
  fpreal getCreasefactor() const { return creasefactor_; }
  bool getCreasesetsangle() const { return creasesetsangle_; }
  fpreal getCreaseangle() const { return creaseangle_; }
  fpreal getCreaseyield() const { return creaseyield_; }
  const UT_StringHolder &getSupportaxes() const { return supportaxes_; }
  const UT_StringHolder &getTieto() const { return tieto_; }
  const UT_StringHolder &getTietoface() const { return tietoface_; }
  fpreal getTiestiffness() const { return tiestiffness_; }
  fpreal getTiewithin() const { return tiewithin_; }
  const UT_StringHolder &getForce() const { return force_; }
  const UT_StringHolder &getWindattrib() const { return windattrib_; }
  bool getFollowrest() const { return followrest_; }

  void fake_load(const std::map<std::string, fake::Parm> &values) override {
    time_ = at(values, "time", "float").numbers[0];
    startframe_ = at(values, "startframe", "float").numbers[0];
    framerate_ = at(values, "framerate", "float").numbers[0];
    gravity_ = vector(at(values, "gravity", "vector"));
    wind_ = vector(at(values, "wind", "vector"));
    airdensity_ = at(values, "airdensity", "float").numbers[0];
    normaldrag_ = at(values, "normaldrag", "float").numbers[0];
    tangentialdrag_ = at(values, "tangentialdrag", "float").numbers[0];
    stiffnessfrom_ = static_cast<int64_t>(at(values, "stiffnessfrom", "ordinal").numbers[0]);
    frequency_ = at(values, "frequency", "float").numbers[0];
    sag_ = at(values, "sag", "float").numbers[0];
    thickness_ = at(values, "thickness", "float").numbers[0];
    kbend_ = at(values, "kbend", "float").numbers[0];
    kstretch_ = at(values, "kstretch", "float").numbers[0];
    density_ = at(values, "density", "float").numbers[0];
    dampingratio_ = at(values, "dampingratio", "float").numbers[0];
    dampingmass_ = at(values, "dampingmass", "float").numbers[0];
    dampingstiffness_ = at(values, "dampingstiffness", "float").numbers[0];
    modes_ = static_cast<int64_t>(at(values, "modes", "integer").numbers[0]);
    doubleprecision_ = at(values, "doubleprecision", "toggle").numbers[0] != 0;
    certify_ = at(values, "certify", "toggle").numbers[0] != 0;
    method_ = at(values, "method", "string").text.c_str();
    reducedfields_ = static_cast<int64_t>(at(values, "reducedfields", "integer").numbers[0]);
    autoerror_ = at(values, "autoerror", "float").numbers[0];
    correctionsteps_ = static_cast<int64_t>(at(values, "correctionsteps", "integer").numbers[0]);
    integrator_ = static_cast<int64_t>(at(values, "integrator", "ordinal").numbers[0]);
    follow_ = at(values, "follow", "toggle").numbers[0] != 0;
    supportfields_ = static_cast<int64_t>(at(values, "supportfields", "integer").numbers[0]);
    proxyvertices_ = static_cast<int64_t>(at(values, "proxyvertices", "integer").numbers[0]);
    proxythickness_ = at(values, "proxythickness", "float").numbers[0];
    supportkind_ = static_cast<int64_t>(at(values, "supportkind", "ordinal").numbers[0]);
    supportgroup_ = at(values, "supportgroup", "string").text.c_str();
    supportattrib_ = at(values, "supportattrib", "string").text.c_str();
    framet_ = vector(at(values, "framet", "vector"));
    framer_ = vector(at(values, "framer", "vector"));
    preset_ = at(values, "preset", "string").text.c_str();
    young_ = at(values, "young", "float").numbers[0];
    poisson_ = at(values, "poisson", "float").numbers[0];
    volumedensity_ = at(values, "volumedensity", "float").numbers[0];
    thicknessmap_ = at(values, "thicknessmap", "string").text.c_str();
    youngmap_ = at(values, "youngmap", "string").text.c_str();
    densitymap_ = at(values, "densitymap", "string").text.c_str();
    bendmap_ = at(values, "bendmap", "string").text.c_str();
    stretchmap_ = at(values, "stretchmap", "string").text.c_str();
    growthmap_ = at(values, "growthmap", "string").text.c_str();
    metresperunit_ = at(values, "metresperunit", "float").numbers[0];
    collidershape_ = static_cast<int64_t>(at(values, "collidershape", "ordinal").numbers[0]);
    collidercells_ = static_cast<int64_t>(at(values, "collidercells", "integer").numbers[0]);
    colliderfriction_ = at(values, "colliderfriction", "float").numbers[0];
    colliderthickness_ = at(values, "colliderthickness", "float").numbers[0];
    collideronesided_ = at(values, "collideronesided", "toggle").numbers[0] != 0;
    colliderdepth_ = at(values, "colliderdepth", "float").numbers[0];
    collidert_ = vector(at(values, "collidert", "vector"));
    colliderr_ = vector(at(values, "colliderr", "vector"));
    envelope_ = at(values, "envelope", "float").numbers[0];
    velocity_ = at(values, "velocity", "toggle").numbers[0] != 0;
    weightattrib_ = at(values, "weightattrib", "string").text.c_str();
    contactpatches_ = at(values, "contactpatches", "string").text.c_str();
    contactpatchesnear_ = at(values, "contactpatchesnear", "float").numbers[0];
    contactpatchesmost_ = static_cast<int64_t>(at(values, "contactpatchesmost", "integer").numbers[0]);
    pushout_ = at(values, "pushout", "toggle").numbers[0] != 0;
    colliderpieces_ = at(values, "colliderpieces", "string").text.c_str();
    dampingmap_ = at(values, "dampingmap", "string").text.c_str();
    stiffnessfactor_ = at(values, "stiffnessfactor", "float").numbers[0];
    youngacross_ = at(values, "youngacross", "float").numbers[0];
    shear_ = at(values, "shear", "float").numbers[0];
    direction_ = vector(at(values, "direction", "vector"));
    directions_ = at(values, "directions", "string").text.c_str();
    restshape_ = at(values, "restshape", "string").text.c_str();
    creasegroup_ = at(values, "creasegroup", "string").text.c_str();
    creasefactor_ = at(values, "creasefactor", "float").numbers[0];
    creasesetsangle_ = at(values, "creasesetsangle", "toggle").numbers[0] != 0;
    creaseangle_ = at(values, "creaseangle", "float").numbers[0];
    creaseyield_ = at(values, "creaseyield", "float").numbers[0];
    supportaxes_ = at(values, "supportaxes", "string").text.c_str();
    tieto_ = at(values, "tieto", "string").text.c_str();
    tietoface_ = at(values, "tietoface", "string").text.c_str();
    tiestiffness_ = at(values, "tiestiffness", "float").numbers[0];
    tiewithin_ = at(values, "tiewithin", "float").numbers[0];
    force_ = at(values, "force", "string").text.c_str();
    windattrib_ = at(values, "windattrib", "string").text.c_str();
    followrest_ = at(values, "followrest", "toggle").numbers[0] != 0;
  }

private:
  static const fake::Parm &at(const std::map<std::string, fake::Parm> &values, const char *name, const char *type) {
    const auto found = values.find(name);
    if (found == values.end() || found->second.type != type)
      throw std::runtime_error(std::string("no such parameter: ") + name);
    found->second.read = true;
    return found->second;
  }
  static UT_Vector3D vector(const fake::Parm &parm) {
    return UT_Vector3D(parm.numbers.at(0), parm.numbers.at(1), parm.numbers.at(2));
  }

  fpreal time_ = 0;
  fpreal startframe_ = 0;
  fpreal framerate_ = 0;
  UT_Vector3D gravity_;
  UT_Vector3D wind_;
  fpreal airdensity_ = 0;
  fpreal normaldrag_ = 0;
  fpreal tangentialdrag_ = 0;
  int64_t stiffnessfrom_ = 0;
  fpreal frequency_ = 0;
  fpreal sag_ = 0;
  fpreal thickness_ = 0;
  fpreal kbend_ = 0;
  fpreal kstretch_ = 0;
  fpreal density_ = 0;
  fpreal dampingratio_ = 0;
  fpreal dampingmass_ = 0;
  fpreal dampingstiffness_ = 0;
  int64_t modes_ = 0;
  bool doubleprecision_ = false;
  bool certify_ = false;
  UT_StringHolder method_;
  int64_t reducedfields_ = 0;
  fpreal autoerror_ = 0;
  int64_t correctionsteps_ = 0;
  int64_t integrator_ = 0;
  bool follow_ = false;
  int64_t supportfields_ = 0;
  int64_t proxyvertices_ = 0;
  fpreal proxythickness_ = 0;
  int64_t supportkind_ = 0;
  UT_StringHolder supportgroup_;
  UT_StringHolder supportattrib_;
  UT_Vector3D framet_;
  UT_Vector3D framer_;
  UT_StringHolder preset_;
  fpreal young_ = 0;
  fpreal poisson_ = 0;
  fpreal volumedensity_ = 0;
  UT_StringHolder thicknessmap_;
  UT_StringHolder youngmap_;
  UT_StringHolder densitymap_;
  UT_StringHolder bendmap_;
  UT_StringHolder stretchmap_;
  UT_StringHolder growthmap_;
  fpreal metresperunit_ = 0;
  int64_t collidershape_ = 0;
  int64_t collidercells_ = 0;
  fpreal colliderfriction_ = 0;
  fpreal colliderthickness_ = 0;
  bool collideronesided_ = false;
  fpreal colliderdepth_ = 0;
  UT_Vector3D collidert_;
  UT_Vector3D colliderr_;
  fpreal envelope_ = 0;
  bool velocity_ = false;
  UT_StringHolder weightattrib_;
  UT_StringHolder contactpatches_;
  double contactpatchesnear_ = 0;
  int64_t contactpatchesmost_ = 0;
  bool pushout_ = false;
  UT_StringHolder colliderpieces_;
  UT_StringHolder dampingmap_;
  fpreal stiffnessfactor_ = 0;
  fpreal youngacross_ = 0;
  fpreal shear_ = 0;
  UT_Vector3D direction_;
  UT_StringHolder directions_;
  UT_StringHolder restshape_;
  UT_StringHolder creasegroup_;
  fpreal creasefactor_ = 0;
  bool creasesetsangle_ = false;
  fpreal creaseangle_ = 0;
  fpreal creaseyield_ = 0;
  UT_StringHolder supportaxes_;
  UT_StringHolder tieto_;
  UT_StringHolder tietoface_;
  fpreal tiestiffness_ = 0;
  fpreal tiewithin_ = 0;
  UT_StringHolder force_;
  UT_StringHolder windattrib_;
  bool followrest_ = false;
};
