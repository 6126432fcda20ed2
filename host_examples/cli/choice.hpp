// What the method "auto" is where no reduced shell follows: limp cloth, which takes the full shell, of large meshes on a proxy.
#pragma once

#include "mesh.hpp"
#include "scene.hpp"
#include "shellwarp.hpp"
#include "simulation.hpp"

#include <cstdint>
#include <string>

namespace cli {

// The shell's size by the length at which it bends under its own weight or the wind, (bending stiffness / load an area)^(1/3): a card has about 2, a skirt 60.
// 0 where stiffness is set by a frequency or a sag, or nothing loads it.
double limpness(const Scene &scene, const Mesh &mesh);

// Whether `auto` may be the full shell: nobody asked for fields, a budget or what it cannot do.
bool may_be_full(const Scene &scene);

// What a run by the full shell takes on two idle cores of 2020 and later, roughly; n vertices, limp.
double seconds_of_full_shell(uint32_t n_vertices, double steps);

// "about 4 minutes"
std::string duration_words(double seconds);

// How many vertices a limp shell may have so that such a run takes some minutes.
uint32_t vertices_for_minutes(double steps);

// Before any long work. `auto` becomes the full shell where the shell is limp, without training; with `on_page` alone, where nothing reads files of the mesh itself, a large
// one becomes a proxy, whose vertices it asks for in scene.proxy. What there is to say: empty, or a sentence.
std::string settle_early(const Mesh &mesh, uint32_t n_frames, bool on_page, Scene &scene);

// After the precompute: why the automatic choice is not a reduced shell, empty where it is one, or went by a budget. The full shell is taken where the library chose it, as fields do
// not hold the shell, and of limp cloth that no training found at rest, of more vertices too.
std::string settle_choice(const shellwarp::Model &model, const Mesh &mesh, uint32_t n_frames, Scene &scene);

// Where nobody said after how many Newton steps of the full shell a frame is shown: at equilibria as many as fields need, none in motion.
void settle_corrections(const shellwarp::Model &model, Scene &scene);

// After a run, where nobody said how long a step is: more steps a frame, where their length costs what can be seen and they are quick. The sentence, or empty.
std::string settle_steps(const Mesh &mesh, uint32_t n_frames, uint32_t method, const Run &run, Scene &scene);

// After a run by what auto took, whose error was estimated: the full shell, where half of what is seen is wrong and a run takes minutes. Where nobody said how long a step is, also
// where a fifth is wrong and it takes one minute; it then takes the `wanted` steps a frame, or as many as fit into two minutes. The sentence, or empty.
std::string settle_late(const shellwarp::Model &model, const Mesh &mesh, uint32_t n_frames, uint32_t wanted, const Run &run, Scene &scene);

}  // namespace cli
