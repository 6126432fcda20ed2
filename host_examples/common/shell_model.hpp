// From a host's mesh and an artist's terms to a precomputed model.
//
// By frequency the shell is made of a sheet of the thickness given, h, of a mean edge l, with E h = 1 and density 1:
//
//   k_length = sqrt(3) l E h / 4    k_area = E h / 2    k_bend = E h³ / 72 (1 - 1/9)
//
// (SwMaterialDesc, for Poisson's ratio -1/3). Its slowest swinging mode has some frequency f0; run with a clock that is
// faster by f / f0 it has the frequency f, and so does every shell that differs by one factor in all its stiffnesses. Hence the
// frequency can be changed without a new precompute. So can a sag: how stiff the full shell must be to hang so far, by sw_state_set_sag. A choice of the method is for the clock that there is when it is made.
#pragma once

#include "request.hpp"
#include "shellwarp.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace host {

// The user stopped a precompute or a run of frames.
class Interrupted : public std::runtime_error {
public:
  Interrupted() : std::runtime_error("stopped by the user; the next evaluation tries again") {}
};

// The watch of a search: it goes on until the host says that the user has had enough.
class UntilInterrupted {
public:
  explicit UntilInterrupted(const std::function<bool()> &interrupted) : interrupted_(interrupted) {}
  bool operator()(double) const noexcept;

private:
  const std::function<bool()> &interrupted_;
};

class ShellModel {
public:
  // `gravity` is its strength in the object's unit and the scene's seconds: a choice of method is made for it, in any direction.
  // Throws HostError for what the user can mend, shellwarp::Error for what the library refuses, Interrupted.
  ShellModel(const Mesh &mesh, const Build &build, double gravity, const std::function<bool()> &interrupted,
             const std::function<void(uint32_t, double)> &progress = {});

  // A model of before, saved, with its rest positions; `held`: anything holds it.
  ShellModel(std::vector<double> rest, bool held, const std::vector<unsigned char> &saved);

  const shellwarp::Model &model() const { return model_; }
  const std::vector<double> &rest() const { return rest_; }  // n x 3
  uint32_t n_points() const { return static_cast<uint32_t>(rest_.size() / 3); }
  bool floats() const { return floats_; }  // nothing holds it
  const std::string &uncalibrated() const { return uncalibrated_; }  // why the stiffness of a proxy is not that of its asset

  // Seconds of the library's clock in one of the scene's. Throws HostError where no mode swings, or where the shell cannot sag so far.
  double clock(const Stiffness &stiffness) const;

private:
  void find_slowest();
  double clock_of_sag(const Stiffness &stiffness) const;

  std::vector<double> rest_;
  bool floats_;
  std::string uncalibrated_;
  shellwarp::Model model_;
  double slowest_ = 0;  // Hz of the slowest mode that swings, in the library's seconds; 0 where none does
  // The last sag that was asked for, and its clock: found once, by a search.
  struct Sag {
    double length;
    Vec3 gravity;
    double clock;
  };
  mutable std::optional<Sag> sag_;
};

// The sheet that a shell by frequency or sag is made of, before its clock; thickness 0 = a two-hundredth of the mesh's size.
SwMaterialDesc sheet_material(const Mesh &mesh, double thickness);

// What all stiffness of a model must be multiplied by for the full shell to hang so far under gravity, to a thousandth. Throws shellwarp::Error.
double stiffness_of_sag(const shellwarp::Model &model, const Vec3 &gravity, double sag);

// Of air in kg/m3, in the model's mass and the object's length.
double air_density(const Stiffness &stiffness, double density);

// The maps that vary and that its kind of stiffness does not take, by name; empty where there are none.
std::string unused_maps(const Stiffness &stiffness);

// A newton in the model's mass and the object's length, and seconds.
double force_scale(const Stiffness &stiffness);

// What decides whether a model can stay: the points' connections and all of Build but the frequency, and the method only by
// what it needs.
uint64_t build_key(const Mesh &mesh, const Build &build);

// Vertices that rest no farther than `distance` from solids at these poses (12 numbers each), both in the object's lengths and axes.
std::vector<uint32_t> patches_near(Mesh mesh, const Build &build, const std::vector<const SwCollider *> &solids, const std::vector<double> &poses, double distance);

// Throws HostError naming the value of a map of factors that has not as many as points, or that is out of range.
void check_map(const Mesh &mesh, const char *what, const std::vector<double> &factors, bool zero_too = false);

// Throws HostError naming the value that is out of its range.
void check_build(const Mesh &mesh, const Build &build);

}  // namespace host
