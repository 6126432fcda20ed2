// What to simulate: a mesh, its material and supports, how the support frame, handles and colliders move, what is expected to come out.
// Filled from a TOML file (read_scene) or from command line options.
#pragma once

#include "collider.hpp"
#include "frame_motion.hpp"
#include "handle_motion.hpp"
#include "loads.hpp"
#include "mesh.hpp"
#include "proxy.hpp"
#include "method.hpp"
#include "moving_points.hpp"
#include "skeleton.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cli {

// Holds the vertices of a box, the listed ones, those of a side or of a group. Clamped also holds their edge neighbours, and so the slope.
struct Support {
  bool clamped = false;
  std::optional<Bounds> box;
  std::vector<uint32_t> vertices;
  std::optional<Side> side{};
  std::string group{};
  std::vector<HandleKey> keys{};              // by ascending time; of a support alone
  std::optional<std::array<double, 3>> about{};  // what it turns about; else the middle of its vertices
  uint32_t axes = 0;                             // SW_AXIS_...: held along these alone; 0 = held in place
  bool symmetric = false;                        // these are normals of planes of symmetry
  std::optional<std::array<double, 3>> nearest{};  // the vertex next to this point
  bool rim = false;                                // of the side, the whole open edge there
};

// Vertices held together with others, or with triangles, by their numbers in the file; and what touches.
struct SceneTie {
  std::vector<std::array<uint32_t, 2>> vertices{}, triangles{};
  double stiffness = 0;  // 0 = stiff
  double within = 0;     // pieces this near each other are tied; 0 = none
};

// One constant's values from a file: by vertices or by triangles.
struct MaterialFile {
  uint32_t quantity = 0;  // SW_MAP_...
  std::string path;
  std::vector<double> values;
};

// Constants of some vertices, in place of those around.
struct MaterialRegion {
  Support where;
  std::vector<std::pair<uint32_t, double>> values;  // SW_MAP_... and its value
  std::string place = "material region";            // in messages
};

// Edges that bend by another stiffness, rest at another angle, or yield, unlike the sheet: those named, and those within a box.
struct MaterialCrease {
  std::optional<Bounds> box{};
  std::vector<std::array<uint32_t, 2>> edges{};  // as the file counts vertices
  double factor = 1;
  std::optional<double> angle{};  // rad; else as the mesh has it
  std::optional<double> yield{};  // rad; else it does not
  std::string place = "material crease";  // in messages
};

// By the paper's constants, or as a sheet in engineering units.
struct Material {
  double k_area = 1e4, k_length = 1e4, k_bend = 1, density = 1;  // the library's defaults
  bool sheet = false;
  double young = 0, poisson = 0, volume_density = 0;  // and thickness, of a sheet
  double frequency = 0, thickness = 0;  // above 0: the stiffness that gives the slowest swing these Hz, in place of k_…
  double sag = 0;                       // or, above 0, by which the shell sags so far under the scene's gravity
  bool by_look() const { return frequency > 0 || sag > 0; }
  double growth = 1;                      // of lengths without stress, where maps and regions do not say
  std::vector<MaterialFile> files{};      // where constants vary; see material_maps.hpp
  std::vector<MaterialRegion> regions{};  // over the files; later ones over earlier ones
  std::vector<MaterialCrease> creases{};  // later ones over earlier ones; see creases.hpp
  std::string rest_shape{};               // mesh file of the shape without stress; empty = the mesh
  double young_across = 0, shear = 0;     // 0 = the same in all directions, and an estimate
  std::vector<double> directions{};       // of young: 3 numbers, or 3 a triangle; see fibres.hpp
  std::string directions_path{};
};

struct Damping {
  double ratio = 0;      // of critical, the same for every mode
  double mass = 0;       // Rayleigh xi, 1/s
  double stiffness = 0;  // Rayleigh zeta, s
  std::string path;      // of the factors
  std::vector<double> factors{};  // on ratio and mass, at the mesh's vertices; none for 1
};

using Range = std::pair<double, double>;

// What must hold at the end of a run. That every position is finite is always expected.
struct Expectations {
  std::optional<uint32_t> modes, zero_modes;
  std::optional<Range> max_displacement;    // largest over the whole run
  std::optional<Range> final_displacement;  // at its end
  std::optional<Range> lowest_frequency;    // Hz
  bool turn_in_range = false;                    // at every frame
  std::optional<double> handle_residual;    // at most, at every step: in model sizes, or radians
  bool handles_met = false;                 // at every step
  bool energy_never_grows = false;          // from frame to frame, see energy_audit.hpp
  std::optional<double> settled;            // at the end: kinetic energy at most this fraction of the elastic
};

// Of one method, at each equilibrium: within a range, or one by one near reference numbers from elsewhere.
struct ComparisonNumbers {
  uint32_t method = SW_METHOD_WARP;
  std::optional<Range> range;
  std::vector<double> reference;
};

struct ComparisonExpectations {
  std::optional<uint32_t> modes;
  std::optional<Range> lowest_frequency;  // Hz, of the first bending stiffness
  bool turn_in_range = false;                  // every method everywhere
  bool warp_below_lma = false;            // its error, everywhere
  bool errors_grow = false;               // with gravity, of every method
  bool stiffer_differs_less = false;      // errors fall with bending stiffness
  std::vector<ComparisonNumbers> errors, area_changes;
  double tolerance = 0;  // of the reference numbers
};

// Equilibria of several methods over gravity and bending stiffness; see comparison.hpp.
struct Comparison {
  std::vector<uint32_t> methods;      // beside the nonlinear shell, which is always there
  std::vector<double> gravities;      // lengths of the gravity vector
  std::vector<double> bending = {1};  // factors on k_bend
  ComparisonExpectations expect;
};

// Another's figures for the same scene, printed beside ours.
struct PaperFigures {
  std::string source, note;  // heading of the column, and a line below it
  std::optional<double> vertices, edges, triangles, modes, precompute_seconds, steps_per_second;
};

// Of the reduced shell: SwPrecomputeDesc.
struct Reduced {
  uint32_t fields = 0, elements = 0, poses = 0;
  bool trained = true;
  double gravity = 0;
};

struct Scene {
  std::string name;  // stem of the files that are written
  std::string title;
  std::string mesh_path;
  std::string render_path;  // of what is drawn in the mesh's place, or empty
  double scale = 1;  // of the mesh's coordinates, as they are read
  std::optional<double> weld;  // vertices within it are one, after the scale; the file's own are drawn
  ProxyOptions proxy;  // simulated in the mesh's place; the file's own vertices are drawn
  std::vector<std::string> inputs;  // the files that it comes from
  std::string length_unit;  // for people only
  std::optional<uint32_t> up;  // axis that a page has upward; else against gravity
  Material material;
  std::vector<Support> supports;
  std::vector<SceneTie> ties{};
  std::string motion_path{};  // where the mesh's vertices are in the world: of supports; see moving_points.hpp
  bool follow_rest = false;   // or of all vertices, as a rest shape that moves
  std::shared_ptr<const MovingPoints> points{};  // of the path, once they are read
  uint32_t modes = 0;  // 0 = the library's default
  std::optional<uint32_t> support_fields;  // SwPrecomputeDesc; else kSupportFields where supports move
  bool double_precision = false;
  uint32_t method = host::kDefaultMethod;
  bool by_auto = false;  // the method is what "auto" became
  Reduced reduced;
  double auto_error = 0, auto_operations = 0;  // of the method "auto": SwPrecomputeDesc; 0 and 0 = without trials
  bool sagged = false;     // linearised where it hangs at rest under gravity; starts there
  bool is_static = false;  // the equilibrium instead of the motion
  bool deterministic = false;  // the same bits on every processor
  uint32_t integrator = 0;  // SW_INTEGRATOR_...; 0 where none is named
  double frame_rate = 30;  // Hz
  uint32_t steps_per_frame = 1;
  bool steps_open = false;  // nobody said how long a step is
  double duration = 5;  // s
  std::array<double, 3> gravity{};
  double stiffness_factor = 1;  // after the precompute
  uint32_t correction_steps = SW_STEPS_AUTO;  // Newton steps of the full shell from each frame that is shown; SW_STEPS_AUTO: at equilibria, where fields are far off
  bool push_out = false;          // frames are shown outside colliders
  std::vector<uint32_t> contact_patches{};  // vertices that are touched by what is smaller than the modes
  std::optional<double> patches_near{};     // as far from the colliders, where they stand first, patches are looked for
  uint32_t n_patches_near = 16;             // at most
  Damping damping;
  FrameMotion motion;
  Loads loads;  // beside gravity
  std::vector<Handle> handles;
  std::vector<Collider> colliders;       // of a file, the same for all its shells
  std::optional<Comparison> comparison;  // in place of a run
  uint32_t obj_frames = 3;               // how many frames of largest displacement are written
  std::vector<double> obj_times;         // s: these frames in their place, unless empty
  std::optional<uint32_t> obj_every;     // every so many frames in the place of both
  std::vector<std::string> formats = {"pc2"};  // see moving_files.hpp
  std::string usd_prim;                  // the prim of an asset that a USD file is to lie over, or empty
  double metres_per_unit = 1;            // of lengths, for USD and glTF
  Expectations expect;
  std::optional<PaperFigures> paper;

  double step() const { return 1.0 / (frame_rate * steps_per_frame); }
};

// What a file holds: one shell, or several that hang on a skeleton. Shells do not touch: each is a scene of its own.
struct SceneFile {
  std::string name, title;
  std::vector<Scene> shells;  // called NAME_SHELL where the file lists them
  Skeleton skeleton;
};

// That of air where nobody says otherwise: 1.2 kg/m3, of a sheet in the scene's unit.
double air_density(const Scene &scene);

// Paths in the file are relative to it. Throws FileError with the line for anything missing, malformed or unknown.
SceneFile read_scene_file(const std::string &path);

// The same for a file of one shell; throws where it holds several.
Scene read_scene(const std::string &path);

// Vertex indices from 0, white space between, '#' begins a comment.
std::vector<uint32_t> read_vertex_list(const std::string &path);

}  // namespace cli
