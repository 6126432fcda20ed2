/* shellwarp: real-time thin shells by modal warping. C99 interface; generated from src/ffi by `make
 * header`, do not edit.
 *
 * The paper: Choi, Woo, Ko, Real-Time Simulation of Thin Shells (Eurographics 2007).
 *
 * Objects. A model is a mesh with material and supports, and after sw_model_precompute its
 * vibration modes; it does not change afterwards and may be shared by any number of states on any
 * threads. A state is one moving shell on a model.
 *
 * Calls. Every function that can fail returns an SwStatus; outputs are untouched on failure, and
 * the message in sw_last_error_message() names the item and the numbers. Nothing throws, aborts or
 * prints. Functions that take an object const may run at the same time as each other on that
 * object; any other combination on one object returns SW_ERROR_BUSY.
 *
 * Structs begin with struct_size, which their sw_..._init function sets to the host's sizeof; after
 * that, zero means default unless a field says otherwise. The elements of output arrays have no
 * struct_size: the host's sizeof is the argument element_size.
 *
 * Pointers. Buffers may be unaligned and strided; lengths are the caller's word. The library keeps
 * no pointer of the host's after a call, callbacks and their user pointers aside where said.
 * Objects must come from this library and be alive.
 *
 * Threads. On x86-64 and 64-bit ARM every call computes in the processor's default floating-point
 * modes, whatever the host has set, so that its bits do not depend on them. After it the host has
 * its own again: rounding, flushing of subnormal numbers, traps, and the flags of what happened, to
 * which none is added. Callbacks run in the host's. On other processors the host keeps to the
 * default. A thread that calls needs 128 KiB of stack.
 *
 * Memory. A frame of a modal method allocates nothing once such a frame has run: sw_state_step,
 * set_gravity, set_frame, set_amplitudes, set_forces with no more forces than before,
 * set_constraint that replaces one of the same axes, positions, positions_of, amplitudes, and
 * report but with SW_PRECOMPUTE_LINEAR. Lists that are not aligned are copied first.
 *
 * Units. Lengths in the mesh's unit, time in seconds, mass as the density gives it; energies and
 * forces follow.
 *
 * Growth. New functions, constants, and fields at the ends of structs raise SW_ABI_VERSION; what is
 * there keeps its meaning, its place and its size, arrays inside structs included.
 *   A host older than the library works as it did: fields that its structs lack are read as zeros,
 *     and are not written.
 *   A host newer than the library works as far as it uses what the library has: fields that the
 *     library lacks are written as zeros; set to anything else they are SW_ERROR_UNSUPPORTED, and
 *     unknown constants SW_ERROR_INVALID_ARGUMENT. Functions that it calls must be there:
 *     sw_abi_version() tells before.
 *   Numbers that a library tells, statuses, phases, kinds, parts, may be newer than the host: it
 *     passes over those that it does not know.
 *
 * Results. The same inputs give the same bits on one build and instruction set, whatever the number
 * of threads. They may change between minor versions of the library; saved data carries a version
 * of its own. */

#ifndef SHELLWARP_H
#define SHELLWARP_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Statuses, messages and versions -------------------------------------------------------------- */

// Result of a call: SW_OK or one of SW_ERROR_.... The message is in sw_last_error_message().
typedef uint32_t SwStatus;

// Done.
#define SW_OK 0
// A pointer is NULL, a value is not finite or out of its range, an enumerant or a flag is unknown.
#define SW_ERROR_INVALID_ARGUMENT 1
// A struct_size or an element_size cannot be the host's sizeof: call the struct's sw_..._init
// first.
#define SW_ERROR_INVALID_DESC 2
// The mesh has a problem of severity error; sw_mesh_check lists them all.
#define SW_ERROR_INVALID_MESH 3
// The model has no modes yet: call sw_model_precompute first.
#define SW_ERROR_NOT_PRECOMPUTED 4
// The progress callback returned SW_PROGRESS_CANCEL.
#define SW_ERROR_CANCELLED 5
// The memory could not be had.
#define SW_ERROR_OUT_OF_MEMORY 6
// A factorization or iteration failed, or a result would not be finite.
#define SW_ERROR_NUMERICAL 7
// A buffer is too small; the message says what is needed.
#define SW_ERROR_BUFFER_SIZE 8
// Saved bytes are damaged, of another version, or belong to another model.
#define SW_ERROR_INVALID_DATA 9
// The object is in use by another thread.
#define SW_ERROR_BUSY 10
// This build or this version does not offer what was asked for, as a field that it does not know.
#define SW_ERROR_UNSUPPORTED 11
// A defect of the library was caught. The object concerned is poisoned: all but its destruction
// fails from now on.
#define SW_ERROR_INTERNAL 12

// The message of the last failed call on this thread, "" if none failed. Never NULL. The text names
// the item and the numbers. The pointer stays valid until the next failed call on this thread or
// its end.
const char *sw_last_error_message(void);

// A short constant description of a status code; "unknown status" for any other number. Never NULL.
const char *sw_status_string(SwStatus status);

// Version of the interface. It grows when functions, fields or constants are added. A host works,
// without being compiled anew, with every library whose sw_abi_version() is at least the
// SW_ABI_VERSION that it was compiled with, as long as the number in the library's file name
// (SONAME) is the same. With an older library it works as far as told under Growth at the top.
#define SW_ABI_VERSION 1

// SW_ABI_VERSION of the header that belongs to the library.
uint32_t sw_abi_version(void);

// The nonlinear shell: SW_METHOD_SHELL_..., sag_gravity.
#define SW_FEATURE_NONLINEAR_SHELL 1
// Wind: sw_state_set_wind with a density.
#define SW_FEATURE_WIND 2
// Saved models: sw_model_save, sw_model_load.
#define SW_FEATURE_SAVED_MODELS 4
// SW_PRECISION_F64.
#define SW_FEATURE_F64_BASIS 8
// SW_PRECISION_I16.
#define SW_FEATURE_I16_BASIS 16
// SW_METHOD_REDUCED_SHELL and reduced_fields.
#define SW_FEATURE_REDUCED_SHELL 32
// Colliders: sw_state_set_colliders.
#define SW_FEATURE_CONTACT 64

// The SW_FEATURE_... that the library was built with; usually all. Every function is there in any
// build; what asks for a missing feature returns SW_ERROR_UNSUPPORTED, and the message names it.
uint32_t sw_features(void);

// Version of the library, such as "0.1.0". Never NULL.
const char *sw_version_string(void);

/* Structs -------------------------------------------------------------------------------------- */

// Initialises a struct that begins with struct_size: zeros into its `size` bytes, and `size` into
// struct_size. It must be the host's sizeof: sw_mesh_desc_init and its like at the end of this
// header call this with it, and languages that cannot call those call this. NULL, or a size below
// 4, does nothing.
void sw_struct_init(void *out,
                    uint32_t size);

/* Buffers -------------------------------------------------------------------------------------- */

// 32-bit floating point.
#define SW_FORMAT_F32 1
// 64-bit floating point.
#define SW_FORMAT_F64 2

/* Log ------------------------------------------------------------------------------------------ */

// Something a curious user may want to know.
#define SW_LOG_INFO 1
// Something was handled that the user should know of.
#define SW_LOG_WARNING 2

// Receives a message. Called on the thread that makes the call concerned; must not throw or
// long-jump.
typedef void (*SwLogFn)(void *user, uint32_t level, const char *message);

// Sets the receiver of log messages for the whole process, NULL for none (the default). The library
// never prints. When this returns, calls under way on other threads may still use the old callback
// once.
SwStatus sw_set_log_callback(SwLogFn callback,
                             void *user);

/* Meshes --------------------------------------------------------------------------------------- */

// Handled: the mesh can be used.
#define SW_SEVERITY_WARNING 1
// The mesh is refused by sw_model_create.
#define SW_SEVERITY_ERROR 2

// Error. A triangle names a vertex that does not exist. element: triangle; `value[0]`: the index.
#define SW_DIAGNOSTIC_INDEX_OUT_OF_RANGE 1
// Error. A triangle names a vertex twice. element: triangle.
#define SW_DIAGNOSTIC_REPEATED_VERTEX 2
// Error. A coordinate is NaN or infinite. element: vertex; `value[0]`: the coordinate.
#define SW_DIAGNOSTIC_NON_FINITE_COORDINATE 3
// Error. Area at most 1e-12 of the longest edge squared. element: triangle; value: area, longest
// edge.
#define SW_DIAGNOSTIC_ZERO_AREA 4
// Error. Two triangles on the same vertices. element: the second; `value[0]`: the first.
#define SW_DIAGNOSTIC_DUPLICATE_TRIANGLE 5
// Error. More than two triangles on an edge. element: its first triangle; vertices: the edge, then
// that triangle's third; `value[0]`: how many.
#define SW_DIAGNOSTIC_NON_MANIFOLD_EDGE 6
// Error. The triangles around a vertex form several fans. element: vertex; `value[0]`: how many
// fans.
#define SW_DIAGNOSTIC_NON_MANIFOLD_VERTEX 7
// Error. No consistent orientation exists, as on a Moebius strip. element: a triangle where it
// fails.
#define SW_DIAGNOSTIC_NOT_ORIENTABLE 8
// Warning. The triangle is turned against its neighbours; it is re-oriented internally. element:
// triangle.
#define SW_DIAGNOSTIC_INCONSISTENT_ORIENTATION 9
// Warning. No triangle uses the vertex; it is carried along with the support frame. element:
// vertex.
#define SW_DIAGNOSTIC_UNREFERENCED_VERTEX 10
// Warning. Two vertices at the same place, perhaps an unwelded seam. element: the second;
// `value[0]`: the first.
#define SW_DIAGNOSTIC_COINCIDENT_VERTICES 11
// Warning. element: triangle; `value[0]`: quality 4 sqrt(3) area / sum of squared sides, below
// 0.02.
#define SW_DIAGNOSTIC_SLIVER 12

// Length of SwDiagnostic::message, the closing NUL included; for good.
#define SW_DIAGNOSTIC_MESSAGE_SIZE 160

// One located problem of a mesh. Output only.
typedef struct SwDiagnostic {
  // SW_DIAGNOSTIC_....
  uint32_t kind;
  // SW_SEVERITY_....
  uint32_t severity;
  // Triangle or vertex, as the kind says.
  uint32_t element;
  // The vertices concerned, UINT32_MAX where unused.
  uint32_t vertices[4];
  // 0.
  uint32_t reserved;
  // Numbers, as the kind says.
  double value[2];
  // The same in words, NUL-terminated.
  char message[SW_DIAGNOSTIC_MESSAGE_SIZE];
} SwDiagnostic;

// A triangle mesh in the host's memory. Nothing is kept: the library copies what it needs during
// the call.
typedef struct SwMeshDesc {
  // Set by sw_mesh_desc_init.
  uint32_t struct_size;
  // SW_FORMAT_F32 or SW_FORMAT_F64: type of the coordinates. Required.
  uint32_t position_format;
  // Rest positions (n_vertices x 3), in any unit of length; all else follows in that unit.
  // Required.
  const void *positions;
  // Bytes from one vertex to the next, 0 = packed. Maya points: 32; Houdini P: 12.
  uint64_t position_stride;
  // Vertex indices from 0 (n_triangles x 3). Required.
  const uint32_t *triangles;
  // Bytes from one triangle to the next, 0 = packed.
  uint64_t triangle_stride;
  // At least 1, below UINT32_MAX.
  uint32_t n_vertices;
  // At least 1, below 2^30.
  uint32_t n_triangles;
} SwMeshDesc;

// Finds every problem of a mesh without building anything; errors come first, then warnings, each
// by kind and element.
//
// Writes min(capacity, *count) diagnostics; `count` is how many there are in all. `diagnostics` may
// be NULL if `capacity` is 0; `element_size` is sizeof(SwDiagnostic). SW_OK says that the check was
// done, not that the mesh is good: read the severities. Callable from any thread.
// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_MESH when a count is
// out of range.
SwStatus sw_mesh_check(const struct SwMeshDesc *mesh,
                       struct SwDiagnostic *diagnostics,
                       uint32_t element_size,
                       uint32_t capacity,
                       uint32_t *count);

/* Materials ------------------------------------------------------------------------------------ */

// Discrete shells: area, length and dihedral-angle terms (Grinspun et al. 2003), as in the paper.
// By k_area, k_length, k_bend and area_density. What these mean depends on the mesh.
#define SW_ENERGY_DISCRETE_SHELLS 1
// Koiter's energy of a thin elastic sheet (1966): St. Venant-Kirchhoff membrane and plate. By
// young, poisson, thickness and volume_density, in engineering units, of which every mesh makes the
// same shell.
#define SW_ENERGY_KOITER 2

// k_area.
#define SW_MAP_K_AREA 1
// k_length: by edges, as the mean of their ends' or of their triangles' values.
#define SW_MAP_K_LENGTH 2
// k_bend: by edges, as the mean of their ends' or of their triangles' values.
#define SW_MAP_K_BEND 3
// area_density.
#define SW_MAP_AREA_DENSITY 4
// young.
#define SW_MAP_YOUNG 5
// thickness, linear within a triangle where it is given at vertices.
#define SW_MAP_THICKNESS 6
// volume_density.
#define SW_MAP_VOLUME_DENSITY 7
// Growth, of either energy: length without stress over that of the mesh, or of rest_positions. An
// edge takes the mean of its ends' or of its triangles' values. Angles between triangles stay. 1.05
// along the rim of a leaf makes it ruffle; 1.001 everywhere is a sheet that was heated. See
// rest_lengths.
#define SW_MAP_GROWTH 8

// One value a vertex, in the mesh's order; triangles take the mean.
#define SW_MAP_ON_VERTICES 1
// One value a triangle, in the mesh's order.
#define SW_MAP_ON_TRIANGLES 2

// A constant's values over the shell, all of them positive. Equal values make the same model as the
// constant does, to the bit.
typedef struct SwMaterialMap {
  // Set by sw_material_map_init.
  uint32_t struct_size;
  // SW_MAP_...: which constant, of the material's energy, or growth.
  uint32_t quantity;
  // SW_MAP_ON_...
  uint32_t on;
  // SW_FORMAT_... of values.
  uint32_t format;
  // Values (count). Read during the call only.
  const void *values;
  // Bytes from value to value; 0 = packed.
  uint64_t stride;
  // Length of values: that of the mesh's vertices or triangles.
  uint32_t count;
  // Must be 0.
  uint32_t reserved;
} SwMaterialMap;

// Material constants: four for each energy, uniform over the shell or by maps. A stiffness of 0 is
// one of 0; but where k_area, k_length and k_bend are all 0, as sw_material_desc_init leaves them,
// all three have their defaults, and an area_density of 0 is 1. A host whose user sets all three to
// 0, or a density of 0, refuses that itself, as the hosts of shellwarp do.
typedef struct SwMaterialDesc {
  // Set by sw_material_desc_init.
  uint32_t struct_size;
  // SW_ENERGY_...; 0 = SW_ENERGY_DISCRETE_SHELLS.
  uint32_t energy;
  // Area stiffness k_A, energy per area, not negative. Default 1e4.
  double k_area;
  // Length stiffness k_L, energy per length, not negative. Default 1e4. On a near-equilateral mesh
  // of edge l the membrane stiffness (Young's modulus times thickness) is about 4 k_L / (sqrt(3)
  // l).
  double k_length;
  // Bending stiffness k_B, energy, not negative. Default 1. The plate rigidity is D = 6 k_B with
  // Poisson's ratio -1/3.
  double k_bend;
  // Mass per area, positive; 0 = 1. Of SW_ENERGY_DISCRETE_SHELLS.
  double area_density;
  // Young's modulus E, force per area, positive: Pa where lengths are in metres and masses in
  // kilograms. This and the next three are of SW_ENERGY_KOITER, and must be 0 with the other
  // energy.
  double young;
  // Poisson's ratio, above -1 and at most 0.5.
  double poisson;
  // Thickness h, a length, positive. The membrane stiffness is E h, the plate rigidity E h^3 / (12
  // (1 - poisson^2)). Beyond a tenth of the radius of curvature, or of the mesh's size, the theory
  // does not hold: sw_model_create logs a warning.
  double thickness;
  // Mass per volume, positive: kg/m^3.
  double volume_density;
  // Maps of constants that vary over the shell (n_maps), at most one a constant. What a map has,
  // its field above may leave 0. Each element begins with the host's sizeof of SwMaterialMap, as
  // sw_material_map_init sets it.
  const struct SwMaterialMap *maps;
  // Length of maps.
  uint32_t n_maps;
  // Must be 0.
  uint32_t reserved;
  // Edges that bend by another stiffness or rest at another angle than the sheet (n_creases x 2
  // vertices, in any order): folds, veins, seams. Each is an edge between two triangles, and stands
  // once.
  const uint32_t *creases;
  // What the stiffness against bending is multiplied by (n_creases), not negative; 0 = turns
  // freely. NULL = 1 for all.
  const double *crease_factors;
  // Rest angles in rad (n_creases), from -pi to pi: 0 is flat, above 0 is convex on the side of the
  // triangles' normals, as re-oriented where these disagree; SW_CREASE_ANGLE_OF_MESH = as the mesh
  // has it. NULL = that for all.
  const double *crease_angles;
  // Length of creases.
  uint32_t n_creases;
  // SW_FORMAT_... of rest_positions.
  uint32_t rest_format;
  // The shape without stress (n_vertices x 3), where it is not the mesh. NULL = the mesh. With this
  // or rest angles the mesh is where the search for rest begins: sw_model_precompute first finds
  // where the shell rests without load, by the full shell, and modes and states begin there.
  // SW_METHOD_POLYNOMIAL_SHELL does not take it, nor SW_METHOD_REDUCED_SHELL where the shell moves
  // freely.
  const void *rest_positions;
  // Bytes from rest position to rest position; 0 = packed.
  uint64_t rest_stride;
  // Of a sheet that is stiffer along a direction than across it, such as paper, a weave or wood:
  // Young's modulus across, positive; young is then that along, and poisson what stretching along
  // takes away across, with poisson^2 < young / young_across. 0 = the same in all directions. A map
  // of young scales it and shear along. Of SW_ENERGY_KOITER.
  double young_across;
  // Shear modulus G between along and across, positive. 0 = Huber's estimate, sqrt(young
  // young_across) / (2 (1 + poisson sqrt(young_across / young))). Only with young_across.
  double shear;
  // Direction of young (n_directions x 3), of any length and either sign: projected into each
  // triangle. Needed with young_across.
  const void *directions;
  // Bytes from direction to direction; 0 = packed.
  uint64_t direction_stride;
  // Length of directions: 1 for all triangles, or n_triangles.
  uint32_t n_directions;
  // SW_FORMAT_... of directions.
  uint32_t direction_format;
  // Vertices held together with others (n_ties x 2): a vertex, and the vertex or triangle that it
  // is tied to. Each stays where it is beside that in the mesh: an offset turns with the triangle,
  // of a vertex elsewhere with the first triangle at it. Components that are tied count as one.
  const uint32_t *ties;
  // Nonzero where the second is a triangle (n_ties). NULL = vertices all.
  const uint8_t *tie_on_triangles;
  // Force per length of the ties (n_ties), not negative; 0 = stiff, a thousand times the shell's
  // own at the stiffer end, so that a tie gives by a thousandth of what the shell does there. NULL
  // = stiff all.
  const double *tie_stiffness;
  // Length of ties.
  uint32_t n_ties;
  // Must be 0.
  uint32_t tie_flags;
  // Ties stiffly what touches, besides: of two components within this distance, the vertices of the
  // one that has more of them so near, each to the nearest triangle of the other. 0 = nothing.
  double tie_distance;
  // How long the mesh's unit is, metres: 1, 0.01 for centimetres. 0 = not told. It changes no
  // number of the shell: sw_model_precompute logs a warning where the shell's own weight on Earth
  // moves it by less than 1e-5 of its size, or bends it as no film bends, and SwModelInfo says by
  // how much. A modulus in GPa shows so, too.
  double metres_per_unit;
  // Yield angles in rad (n_creases), positive: how far the angle of a crease comes from its rest
  // angle elastically. Where a step or an equilibrium ends further from it, the state's own rest
  // angle has followed to this far: a fold that stays. Infinite = elastic. NULL = infinite for all.
  // States take their rest angles along when they are cloned, saved and loaded, and go on by
  // another method; sw_state_reset gives back those above. Only SW_METHOD_REDUCED_SHELL and the
  // full shell yield; with others sw_state_create fails. Such a crease has a hinge of its own in
  // SW_ENERGY_KOITER, as one of another factor than 1 has: its moment stays below the factor times
  // the sheet's own stiffness at the edge times this angle. With a factor of 0 it does nothing.
  const double *crease_yields;
  // Edges that without stress are of another length than in the mesh, or in rest_positions
  // (n_rest_lengths x 2 vertices, in any order), each once. The shell need not be able to have all
  // these lengths at once: it then rests under stress, as a leaf does whose rim grew. Areas and
  // masses without stress follow from the lengths, angles from the mesh, rest_positions or creases.
  // As with rest_positions, sw_model_precompute first finds where the shell rests, and the same
  // methods take it. SW_MAP_GROWTH scales the other edges.
  const uint32_t *length_edges;
  // Their lengths (n_rest_lengths), positive. In each triangle every length must be less than the
  // other two together.
  const double *rest_lengths;
  // Length of length_edges and rest_lengths.
  uint32_t n_rest_lengths;
  // Must be 0.
  uint32_t length_flags;
} SwMaterialDesc;

// Of a crease: the angle that the mesh has there.
#define SW_CREASE_ANGLE_OF_MESH 7

/* Models --------------------------------------------------------------------------------------- */

// Which vertices are held in place in the support frame. Lists may repeat vertices.
typedef struct SwSupportDesc {
  // Set by sw_support_desc_init.
  uint32_t struct_size;
  // Must be 0.
  uint32_t flags;
  // Fixed vertices (n_fixed). A straight row of them is a hinge: nothing resists turning about it.
  const uint32_t *fixed;
  // Clamped vertices (n_clamped): fixed together with all their edge neighbours, which holds the
  // slope as well. With SW_ENERGY_KOITER the slope is held exactly at edges between two of them,
  // and their neighbours stay free; only those on no such edge need these.
  const uint32_t *clamped;
  // Length of fixed.
  uint32_t n_fixed;
  // Length of clamped.
  uint32_t n_clamped;
  // Vertices held along some axes of the support frame only (n_axis_vertices): on a symmetry plane,
  // a diaphragm, a rail. What is held stays exactly at zero in every mode, field, step and answer.
  // Those that are fixed or clamped besides are fixed.
  const uint32_t *axis_vertices;
  // Which axes each is held along: SW_AXIS_X, SW_AXIS_Y and SW_AXIS_Z or'ed (n_axis_vertices), or
  // NULL.
  const uint8_t *axes;
  // A direction that each is held along besides, of any length, zero for none (n_axis_vertices x
  // 3), or NULL.
  const double *axis_directions;
  // Length of axis_vertices.
  uint32_t n_axis_vertices;
  // Must be 0.
  uint32_t reserved;
  // Which of the axes are normals of planes of symmetry: SW_AXIS_X, SW_AXIS_Y and SW_AXIS_Z or'ed,
  // and SW_AXIS_DIRECTION for that of axis_directions (n_axis_vertices), or NULL. The vertex is
  // held along them, as by axes. Boundary edges between two vertices on the same plane also keep
  // their slope, as if the shell went on beyond as its mirror image: half a shell then bends as the
  // whole. Each such vertex must be on such an edge.
  const uint8_t *symmetric_axes;
} SwSupportDesc;

// Of SwSupportDesc::symmetric_axes: the direction in axis_directions.
#define SW_AXIS_DIRECTION 8

// A shell and, after precompute, its modes. Opaque.
typedef struct SwModel SwModel;

// Makes a model of a mesh, a material (NULL = defaults) and supports (NULL = none: the shell floats
// free).
//
// On success *model is a new object, to be given to sw_model_destroy; on failure it is untouched.
// The descriptors and what they point to are copied. Callable from any thread.
// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_MESH,
// SW_ERROR_NUMERICAL when masses leave the floating-point range, SW_ERROR_OUT_OF_MEMORY.
SwStatus sw_model_create(const struct SwMeshDesc *mesh,
                         const struct SwMaterialDesc *material,
                         const struct SwSupportDesc *supports,
                         struct SwModel **model);

// Destroys a model. NULL does nothing. States made from it live on. An object must not be destroyed
// twice or during a call.
void sw_model_destroy(struct SwModel *model);

// Saves a precomputed model, so that sw_model_load gives it back without another precompute: about
// 24 bytes per vertex and mode (48 with SW_PRECISION_F64, 12 with SW_PRECISION_I16) and 49 per
// vertex, or 73 with sag_gravity; 12 (24 with SW_PRECISION_F64) more per vertex and mode or field
// of a reduced shell. Two calls: with `bytes` NULL and `capacity` 0 only *size is written. Nothing
// of a state is saved (sw_state_save), and no time: two precomputes of the same input on one
// machine save the same bytes. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_NOT_PRECOMPUTED, SW_ERROR_BUFFER_SIZE when capacity <
// *size, SW_ERROR_UNSUPPORTED by a library without SW_FEATURE_SAVED_MODELS, SW_ERROR_OUT_OF_MEMORY,
// SW_ERROR_BUSY.
SwStatus sw_model_save(const struct SwModel *model,
                       void *bytes,
                       uint64_t capacity,
                       uint64_t *size);

// Makes a precomputed model of what sw_model_save gave, in this or an older version of the library.
// On success *model is a new object, to be given to sw_model_destroy; on failure it is untouched.
// `bytes` (size) are read during the call only.
//
// The model has the same bits as the one saved: steps, handles, equilibria and saved states of
// either go on with the other. No eigenvalue search is done; the time goes into reading the bytes
// and checking the mesh. Safe on any bytes: they carry a version, sizes and a checksum, and
// whatever they hold beyond that is checked, so that forged ones cannot do harm; that the modes
// belong to the shell is not checked. Callable from any thread.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DATA, SW_ERROR_UNSUPPORTED by a library
// without SW_FEATURE_SAVED_MODELS or the model's precision, SW_ERROR_OUT_OF_MEMORY.
SwStatus sw_model_load(const void *bytes,
                       uint64_t size,
                       struct SwModel **model);

/* Known materials ------------------------------------------------------------------------------ */

// Number of materials in the table of presets.
uint32_t sw_preset_count(void);

// A preset's name for files and scripts, such as "printer-paper": lower case, parted by hyphens. It
// never changes, but its index may. "" at and beyond sw_preset_count(). Never NULL; constant.
const char *sw_preset_name(uint32_t index);

// A preset's name for menus, such as "Printer paper, 80 g/m2". "" at and beyond sw_preset_count().
// Never NULL; constant.
const char *sw_preset_label(uint32_t index);

// Where a preset's numbers are from, and how far they vary. "" at and beyond sw_preset_count().
// Never NULL; constant.
const char *sw_preset_source(uint32_t index);

// Makes an initialised descriptor that of a preset: energy, young, poisson, thickness and
// volume_density. Mass is in kilograms. `metres_per_unit` is how long the mesh's unit is: 1 for
// metres, 0.01 for centimetres. The numbers are as in docs/reference/materials.md.
// Errors: SW_ERROR_INVALID_ARGUMENT, also at and beyond sw_preset_count(), SW_ERROR_INVALID_DESC.
SwStatus sw_preset_material(uint32_t index,
                            double metres_per_unit,
                            struct SwMaterialDesc *material);

/* Precompute ----------------------------------------------------------------------------------- */

// Go on.
#define SW_PROGRESS_CONTINUE 256
// Stop: sw_model_precompute returns SW_ERROR_CANCELLED and the model stays as it was.
#define SW_PROGRESS_CANCEL 512

// Stiffness and masses.
#define SW_PHASE_ASSEMBLY 0
// Fill-reducing ordering, symbolic factorization.
#define SW_PHASE_ORDERING 1
// Numeric factorization.
#define SW_PHASE_FACTORIZATION 2
// Eigenvalue iteration.
#define SW_PHASE_MODES 3
// Inertia count and residuals.
#define SW_PHASE_CERTIFICATE 4
// Modal rotations and run-time layout.
#define SW_PHASE_ROTATION 5
// Equilibria of the full shell, and the reduced shell that is trained on them.
#define SW_PHASE_TRAINING 6
// Number of phases, which grows with them.
#define SW_PHASE_COUNT 7
// Places for the phases in SwModelInfo::seconds, for good: there will not be more.
#define SW_PHASE_CAPACITY 16

// Hears of progress on the thread that called sw_model_precompute: SW_PHASE_... and the fraction of
// that phase, 0 to 1. A phase may come up more than once, or not at all on a small mesh, and a
// newer library may have phases that this header does not. Work on a mesh in pieces is told as
// SW_PHASE_MODES, piece by piece. A numeric factorization is one step, during which nothing is
// heard and no cancel is taken: some tenths of a second for 10^4 vertices and some seconds for
// 10^5. There are two or more. With more than 60 fields and modes parts of SW_PHASE_TRAINING are as
// silent, up to two seconds. Must return SW_PROGRESS_CONTINUE or SW_PROGRESS_CANCEL; anything else
// is an error, so that a callback which forgets to return is found out. Must not throw or
// long-jump, nor destroy the model.
typedef uint32_t (*SwProgressFn)(void *user, uint32_t phase, double fraction);

// The run-time basis in 32 bits: half the memory and time; positions good to about 1e-6 of the
// displacement.
#define SW_PRECISION_F32 1
// The run-time basis in 64 bits.
#define SW_PRECISION_F64 2
// The run-time basis in 16 bits of a unit for each mode, computed with in 32: half the memory of
// SW_PRECISION_F32, and as fast where memory limits; positions good to about 1e-5 of the
// displacement (basis_rounding of SwModelInfo).
#define SW_PRECISION_I16 3

// For SW_METHOD_LMA and the nonlinear shells alone: no modal rotations are computed, and the basis
// takes half the memory. States are then SW_METHOD_LMA by default, whose sw_state_rotations and
// constraints on orientations return SW_ERROR_UNSUPPORTED, and so does making a state of another
// modal method.
#define SW_PRECOMPUTE_LINEAR 1

// For SW_METHOD_AUTO, in a time that needs no asking: with a reduced shell of reduced_fields (0 =
// 40, or 64 where a shell that is held is told of handles; fewer where modes and fields would be
// more than 128) where the shell can have one, and else without. Unless reduced_poses,
// reduced_seconds or reduced_mode_searches say otherwise, its training ends after 8e7 / (vertices
// to the power 1.5) iterations, about half a minute, with the same result everywhere. No reduced
// shell is made of a shell with sag_gravity or support_fields; nor, unless a limit is given, above
// 10,000 vertices. Nor is one made of a shell that moves freely with too few modes, in pieces or
// with a rest shape of its own, nor where training finds fewer than four equilibria.
// sw_model_offers tells why, auto_method of SwModelInfo what became of it. With auto_error or
// auto_operations these choose.
#define SW_PRECOMPUTE_AUTO 2

// SW_METHOD_AUTO may be SW_METHOD_SHELL_IMPLICIT, by steps of second order, where the shell has at
// most 2,500 vertices and SW_PRECOMPUTE_AUTO or reduced_fields train it: where what was trained
// misses half of its training by more than 5 % (auto_corrects of SwModelInfo) and supports hold the
// shell, and where SW_PRECOMPUTE_AUTO finds fewer than four equilibria. A step then takes a
// hundredth of a second to a second, where fields take microseconds. States with
// SW_STATE_DETERMINISTIC keep to the fields. With auto_error or auto_operations these choose. For
// hosts that show one shell or a few; saved models keep the choice.
#define SW_PRECOMPUTE_AUTO_FULL 4

// The reduced shell's fields are the modes' own derivatives: no training, a fraction of the
// precompute, and many times the error.
#define SW_REDUCED_UNTRAINED 1

// What to precompute.
typedef struct SwPrecomputeDesc {
  // Set by sw_precompute_desc_init.
  uint32_t struct_size;
  // Number of lowest modes, zero modes included; 0 = 16, or 256 with a tolerance. No more are given
  // than there are unknowns, nor more than 1024; sw_model_info tells. Loose pieces have six zero
  // modes each, which come before all others. Where more modes are equal than are given, those come
  // first that translations along x, y and z agree with: they hold all that gravity does to the
  // equal ones. Rotations about the centre of mass are next, then fixed pseudo-random mixtures. A
  // shell in thousands of pieces costs what one piece of its size costs.
  uint32_t modes;
  // SW_PRECISION_... of the run-time basis; 0 = SW_PRECISION_F32. Modes are always computed in 64
  // bits.
  uint32_t precision;
  // SW_PRECOMPUTE_... or 0.
  uint32_t flags;
  // NULL = none.
  SwProgressFn progress;
  // Passed to progress.
  void *progress_user;
  // Gravity in frame axes, acceleration. Unless zero, the mesh is first let sag under it to rest by
  // the nonlinear shell, and modes are those of the sagged shape under its own weight; states begin
  // there, and displacements and max_displacement count from there. Under this gravity the shape is
  // then exact, and under others the error of a modal method grows with the difference only. The
  // shell must be supported.
  double sag_gravity[3];
  // Unless 0, modes are left out that a scene cannot show: under the loads below, no vertex is off
  // by more than this length, against the same method with all modes. `modes` is then the most that
  // are computed; 0 = 256. sw_model_info tells the bound that was reached, which exceeds the
  // tolerance where that was not enough; SW_ERROR_NUMERICAL where there is none. The bound is an
  // estimate by statics, see demand_amplification, and holds for turns of less than a rad.
  double tolerance;
  // Gravity of the scene in frame axes. Read, as all fields from here to n_handles, with a
  // tolerance or for SW_METHOD_AUTO only.
  double demand_gravity[3];
  // Size of an acceleration that may act in any direction: of the frame, or gravity where the frame
  // turns.
  double demand_acceleration;
  // How much further loads move the shell than at rest: 1 when they change slowly; 0 = 2, when they
  // come at once; up to 2/(pi ratio) when they shake it in time with a mode of that damping ratio.
  double demand_amplification;
  // How far from rest handles move their vertices, in the directions in which these give. For a
  // tolerance, to hold a vertex in others as well can ask for more modes; see auto_error for what
  // is judged there.
  double handle_distance;
  // The vertices that handles move (n_handles). A reduced shell reads them, too, and spends up to
  // half of its fields on how it gives there: three for pulls at each, and three for turns where
  // the half has room for those of all. From 24 fields on the training of a shell that is held
  // leads the full shell by them, by a fifth of its size where it gives most, the others held at
  // rest.
  const uint32_t *handles;
  // Length of handles.
  uint32_t n_handles;
  // SW_AXIS_... bits of the frame's axes along which handles hold their vertices, for
  // SW_METHOD_AUTO; 0 = all.
  uint32_t handle_axes;
  // Displacement fields beyond the modes for SW_METHOD_REDUCED_SHELL, which needs some; 0 = none,
  // and the model takes no more time and memory than without. 40 suit 8 modes, 64 where handles are
  // told to a shell that is held; modes and fields are at most 128 together. sag_gravity must be
  // zero. A shell that moves freely, in one piece, needs all its rigid motions among the modes: 6
  // modes more where nothing holds it.
  uint32_t reduced_fields;
  // Triangles, edges and hinges, together, that stand for all in its steps, whose cost grows with
  // their number; 0 = as many as leave out 1 % of the elastic forces, but at most 16 for each mode
  // and field.
  uint32_t reduced_elements;
  // Equilibria of the full shell that its fields are trained on: under gravity along the axes,
  // pressure, by handles that are known, under weak pulls at points, gravity along the diagonals
  // between the axes and strong pulls; then by half of each but the weak pulls. At most 62 are
  // used, or 68 where handles are known. Each takes as long as a static solution of
  // SW_METHOD_SHELL_IMPLICIT. Of a load that buckles the shell only the part is used that was
  // balanced after a few hundred iterations, from 8,000 vertices on after a hundred. The fields are
  // saved with the model. 0 = as many as 208,000 over the number of vertices, at most 62.
  uint32_t reduced_poses;
  // Bitwise or of SW_REDUCED_...
  uint32_t reduced_flags;
  // Strength of the gravity that its scenes will have, acceleration, from which the loads of the
  // training follow; 0 = what bends the shell by a quarter of its size to first order.
  // SW_ERROR_NUMERICAL beyond 1e12 times that.
  double reduced_gravity;
  // Unless this and auto_operations are both 0, the method for SW_METHOD_AUTO is chosen, and the
  // model made for it alone. Tried are SW_METHOD_LMA, SW_METHOD_WARP, SW_METHOD_WARP_VIRTUAL_WORK
  // and SW_METHOD_ROTATION_STRAIN, the last two also on the shape that hangs under demand_gravity,
  // and SW_METHOD_REDUCED_SHELL with reduced_fields (0 = 40) and with half as many; with
  // SW_PRECOMPUTE_LINEAR only the first and the reduced shells. With sag_gravity the modes are
  // those of that shape, and no reduced shell is tried. Taken is the cheapest that gets no vertex
  // wrong by more than this length against the full shell's equilibria; else the most accurate.
  // Trials are demand_gravity, demand_acceleration and handles, read without a tolerance too.
  //
  // A handle's position is held hard along handle_axes. It is led in four parts from where it hangs
  // to handle_distance from rest, in each direction in which the vertex gives at least a tenth as
  // much as in its softest, either way: straight, along the way that the shell's vertex takes by
  // itself, and straight between these directions. Each part is judged, and the errors of handles
  // count a quarter more, for places in between. Not judged are orientations, several handles at
  // once, more than six of them, compliances, and motion. A flat sheet that is lifted straight with
  // all axes held is stretched, and no method is near there: hold only the axes that matter.
  //
  // Takes about four times a precompute, each reduced shell with its training, and an equilibrium
  // of the full shell for each load, for handles at most 200.
  double auto_error;
  // Chosen among are those of these methods whose step takes no more operations than this, as
  // sw_state_plan counts them, or else the cheapest alone; 0 = all.
  double auto_operations;
  // The fastest that handles move, length/s; 0 = any. With a tolerance, where it is known, the
  // modes' static answers to pulls at the handles may stand for those modes that nothing else
  // needs, up to three a handle: hundreds of modes are then a few. They are counted and saved as
  // modes, and have frequencies as these, of their own energy; sw_model_info's certificate is of
  // the modes beside them.
  double handle_speed;
  // Seconds that the training by reduced_poses may take, from the end of the modes' work to the end
  // of the precompute; 0 = any. No further equilibrium is sought once what follows would end later,
  // and none where that leaves less time than what came before took. What follows is estimated:
  // trainings were measured to take up to two fifths more. Where it would take more than half of
  // the time, samples and the polynomial are fitted to a quarter of the examples or fewer; it is
  // not cut further. What is found in time depends on the machine and its load, and with it the
  // fields: reduced_poses alone gives the same ones every time.
  double reduced_seconds;
  // The same as a multiple of the time that the modes took; 0 = any.
  double reduced_mode_searches;
  // Vertices (n_contact_patches) where the shell is to be touched by what is smaller than its
  // modes. The shell's static answer to a push along the normal at each joins the modes, and with
  // them the methods that move by modes. They are counted and saved as modes, and have frequencies
  // as these, of their own energy. The shell must be held so that nothing moves freely. Not with
  // auto_error or auto_operations. NULL = none.
  const uint32_t *contact_patches;
  // Length of contact_patches.
  uint32_t n_contact_patches;
  // Fields by which the modal methods follow supports that move against each other
  // (sw_state_move_supports); 0 = none. The first follow each group of supports that edges join as
  // it moves, turns and strains, 12 a group less the 6 rigid motions of all, which need none;
  // further ones follow its bending: 24 suit most. The shell's static answer to each is solved for,
  // and they cost in a step and in output as much as modes. Not for a shell with clamped edges of
  // SW_ENERGY_KOITER: fix two rows there.
  uint32_t support_fields;
} SwPrecomputeDesc;

// Computes modes and modal rotations; `desc` may be NULL for defaults. May be called again with
// other options: states made before keep the modes they were made with.
//
// Blocks for seconds on large meshes. On failure or cancellation the model is as it was before. Not
// to be called at the same time as any other function on this model.
// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_CANCELLED, SW_ERROR_NUMERICAL,
// also when the shell does not come to rest under sag_gravity or is about to buckle there,
// SW_ERROR_UNSUPPORTED for a reduced shell that moves freely in several pieces, whose modes do not
// hold all its rigid motions, or that has sag_gravity, and for what this library was built without;
// SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
SwStatus sw_model_precompute(struct SwModel *model,
                             const struct SwPrecomputeDesc *desc);

/* What a model has ----------------------------------------------------------------------------- */

// Facts about a model. The caller sets struct_size with sw_model_info_init.
typedef struct SwModelInfo {
  // Set by sw_model_info_init.
  uint32_t struct_size;
  // Vertices of the mesh.
  uint32_t n_vertices;
  // Triangles of the mesh.
  uint32_t n_triangles;
  // Edges.
  uint32_t n_edges;
  // Edges with two triangles.
  uint32_t n_interior_edges;
  // Connected components.
  uint32_t n_components;
  // Vertices that no triangle uses.
  uint32_t n_unreferenced;
  // Triangles turned over internally.
  uint32_t n_reoriented;
  // Vertices held by supports, clamped neighbours included.
  uint32_t n_fixed;
  // Three per vertex that moves, less the axes that it is held along.
  uint32_t n_unknowns;
  // 1 after sw_model_precompute, else 0; all fields below but mass, area, size, metres_per_unit and
  // earth_gravity are 0 before.
  uint32_t precomputed;
  // Number of modes.
  uint32_t modes;
  // How many of them have eigenvalue 0: rigid motions and mechanisms that nothing resists.
  uint32_t zero_modes;
  // Eigenvalues below inertia_shift by the inertia of an LBL^T factorization.
  uint32_t inertia_count;
  // Modes found below inertia_shift. Equal to inertia_count: none is missing. Larger than modes
  // when these end inside a group of repeated eigenvalues: 6000 for 16 modes of 1000 loose pieces.
  uint32_t inertia_found;
  // SW_PRECISION_....
  uint32_t precision;
  // Sum of the lumped masses.
  double total_mass;
  // Sum of the rest areas.
  double total_area;
  // Diagonal of the bounding box.
  double size;
  // max |K phi - lambda M phi| / (|K| |phi|) over the modes, 2-norms and the 1-norm of K.
  double residual;
  // max |Phi^T M Phi - I|.
  double orthonormality;
  // Where eigenvalues were counted, 1/s^2.
  double inertia_shift;
  // Seconds by SW_PHASE_...; 0 beyond the last. Their sum is the time of the precompute, with
  // phases that a host does not know. 0 of a model that was loaded.
  double seconds[SW_PHASE_CAPACITY];
  // Bytes that the model holds for the run.
  uint64_t bytes_model;
  // Bytes of one state of a modal method.
  uint64_t bytes_state;
  // Estimate of the most bytes held at once during precompute. With a reduced shell it is by what
  // trainings on two threads took, and right within a half.
  uint64_t bytes_precompute_peak;
  // Largest rounding error e of a component of a mode shape phi or its rotation psi in the run-time
  // basis, relative to the largest such component of its mode. With amplitudes q it moves no vertex
  // by more than sqrt(3) e times the sum over the modes of |q_k| (max|phi_k| + max|psi_k| max|u|),
  // u the displacement without the warp.
  double basis_rounding;
  // How far a vertex may be off because modes were truncated, by the tolerance and the demand of
  // SwPrecomputeDesc; 0 without one, and on a model that was loaded.
  double truncation_bound;
  // Share of the mass that moves which the modes carry along x, y, z of the frame: far below 1,
  // modes are missing for loads along that axis.
  double effective_mass[3];
  // Fields of SW_METHOD_REDUCED_SHELL beyond the modes; fewer than asked for where these span no
  // more. 0 = it has none.
  uint32_t reduced_fields;
  // Number of sampled elements.
  uint32_t reduced_elements;
  // What these leave of the elastic forces and the rest stiffness that they were chosen by,
  // relative.
  double reduced_residual;
  // Largest share by which an eigenvalue by the factorized stiffness and by the energy of its mode
  // differ: the digits that rounding has left of it in stiff cases, where residual, a share of the
  // largest stiffness, says nothing. Above 1e-2 the precompute refuses. 0 on a model that was
  // loaded.
  double eigenvalue_disagreement;
  // What SW_METHOD_AUTO means here, an SW_METHOD_.... sw_model_front tells what it went by, if it
  // was tried.
  uint32_t auto_method;
  // Fields that follow moving supports; fewer than asked for where supports are few.
  uint32_t support_fields;
  // Its largest error in the choice, length; DBL_MAX where it found no equilibrium under one of the
  // loads.
  double auto_error;
  // metres_per_unit of the material; 0 = not told, as it is not on a model that was loaded.
  double metres_per_unit;
  // The Earth's gravity in the mesh's unit, 9.80665 / metres_per_unit: what a host sets by
  // sw_state_set_gravity, downward, where its scene has none. 0 where the unit was not told.
  double earth_gravity;
  // How far this moves a vertex at most along x, y or z to first order, as far as the modes tell,
  // in sizes of the mesh; 0 where the unit was not told.
  double weight_moves;
  // How far it turns one, rad; 0 with SW_PRECOMPUTE_LINEAR, too.
  double weight_turns;
  // What that form of the reduced shell which the training chose misses of the equilibria that its
  // fields were trained on, relative, by mass: half of them by less. 0 where none was chosen by
  // them: by auto_error or auto_operations, without fields, without a training.
  double training_error_median;
  // Nine tenths of them by less. What moves the shell by less than a thousandth of the furthest
  // does not count.
  double training_error_most;
  // 1 where training_error_median is above 0.05: the fields do not hold the shell as far as that
  // moves it. SW_METHOD_SHELL_IMPLICIT is for its motion, which SW_METHOD_AUTO is with
  // SW_PRECOMPUTE_AUTO_FULL; sw_state_correct by SW_STEPS_AUTO is for its equilibria by fields.
  uint32_t auto_corrects;
  // 0.
  uint32_t reserved;
} SwModelInfo;

// Counts, sizes, certificate and timings. `info` must be initialised by sw_model_info_init.
// Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_BUSY during a precompute.
SwStatus sw_model_info(const struct SwModel *model,
                       struct SwModelInfo *info);

// A method that was tried for SW_METHOD_AUTO. Output only.
typedef struct SwFrontPoint {
  // SW_METHOD_....
  uint32_t method;
  // 1 for the one that was taken.
  uint32_t chosen;
  // 1 for modes of the shape that hangs under demand_gravity.
  uint32_t sagged;
  // Fields beyond the modes, of a reduced shell.
  uint32_t fields;
  // Its elements.
  uint32_t elements;
  // 1 where it found no equilibrium under one of the loads; error is then DBL_MAX.
  uint32_t failed;
  // Of a step, as sw_state_plan counts them.
  double operations;
  // The furthest that any vertex is off under any of the loads, length.
  double error;
} SwFrontPoint;

// The methods that were tried for SW_METHOD_AUTO, none on a model without a choice. `element_size`
// is sizeof(SwFrontPoint). Two calls: with `points` NULL and `capacity` 0 only *count is written.
// Callable concurrently.
// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity <
// *count, SW_ERROR_NOT_PRECOMPUTED, SW_ERROR_BUSY.
SwStatus sw_model_front(const struct SwModel *model,
                        struct SwFrontPoint *points,
                        uint32_t element_size,
                        uint32_t capacity,
                        uint32_t *count);

// Frequencies sqrt(lambda)/(2 pi) in Hz, ascending; a zero mode's is exactly 0. Two calls: with
// `hertz` NULL and `capacity` 0 only *count is written. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *count,
// SW_ERROR_NOT_PRECOMPUTED, SW_ERROR_BUSY.
SwStatus sw_model_frequencies(const struct SwModel *model,
                              double *hertz,
                              uint32_t capacity,
                              uint32_t *count);

// Phi: displacement per unit amplitude, mass-orthonormal, 1/sqrt(mass).
#define SW_SHAPE_DISPLACEMENT 1
// Psi = W Phi: rotation vector per unit amplitude (paper eq. 10).
#define SW_SHAPE_ROTATION 2

// One mode (n_vertices x 3) as SW_SHAPE_..., in SW_FORMAT_..., `stride` bytes from vertex to vertex
// (0 = packed). The sign and the basis of repeated modes follow a fixed rule: modes agree with the
// translations along x, y, z, then the rotations about them, then a fixed random field, the first
// that they see. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the mesh's;
// SW_ERROR_NOT_PRECOMPUTED; SW_ERROR_UNSUPPORTED for rotations of a model with
// SW_PRECOMPUTE_LINEAR; SW_ERROR_NUMERICAL when SW_FORMAT_F32 does not hold them; SW_ERROR_BUSY.
SwStatus sw_model_mode_shape(const struct SwModel *model,
                             uint32_t mode,
                             uint32_t shape,
                             uint32_t format,
                             void *out,
                             uint64_t stride,
                             uint32_t n_vertices);

/* Methods -------------------------------------------------------------------------------------- */

// Modal warping (the paper): u = R~(Psi q) Phi q, modal force Phi^T R^T F.
#define SW_METHOD_WARP 1
// Linear modal analysis: u = Phi q, modal force Phi^T F.
#define SW_METHOD_LMA 2
// The full nonlinear shell by backward Euler with Newton's method: ground truth, seconds a frame on
// large meshes. No amplitudes, and one damping ratio, that of its slowest swing; saved states hold
// every vertex.
#define SW_METHOD_SHELL_IMPLICIT 3
// The same by symplectic Euler; steps must be very short (the paper: 1/30000 s).
#define SW_METHOD_SHELL_EXPLICIT 4
// Modal warping with the exact modal force of its own positions, (du/dq)^T F: dead loads are
// conservative. A step costs up to twice that of SW_METHOD_WARP.
#define SW_METHOD_WARP_VIRTUAL_WORK 5
// The full nonlinear energy on a few displacement fields, u = B q, by a Runge-Kutta method of
// second order and Newton's method, of a model precomputed with reduced_fields: a fraction of the
// warp's error, without its limit of rotation, at a step's cost that hardly grows with the mesh. No
// amplitudes. Stiffness damping is by the stiffness of the present shape, damping ratios are those
// of the modes. The integrator is its own.
#define SW_METHOD_REDUCED_SHELL 6
// The reduced shell with its energy as a polynomial of the fields' amplitudes, of the same model
// and training: no element is evaluated in a step, which takes a fraction of the time of
// SW_METHOD_REDUCED_SHELL and does not know the mesh. Where hinges turn by radians or edges stretch
// by tenths of their length it is too stiff. A model that was saved without it is refused:
// precompute anew. So is one with ties, or under stress at rest.
#define SW_METHOD_POLYNOMIAL_SHELL 9
// Both of these: SW_METHOD_POLYNOMIAL_SHELL as long as the shell is no further from rest, in the
// mass norm, than the training's equilibria up to which the polynomial was as good as the samples,
// SW_METHOD_REDUCED_SHELL beyond, and back at four fifths of it. Both have the same fields, so that
// nothing jumps but the cost of a step and the elastic energy that is told. A saved state knows
// which form acts; sw_state_plan tells. Refused as SW_METHOD_POLYNOMIAL_SHELL is, and for shells
// that move freely.
#define SW_METHOD_ADAPTIVE_SHELL 10
// Rotation-strain reconstruction: each triangle is turned by the rotation of its modal displacement
// and keeps its linear strain, and the vertices follow; modal force (du/dq)^T F. What bends without
// stretching keeps its lengths and area, so that large bends of shells that are flat at rest come
// closer to the nonlinear shell; on curved ones it is as close as SW_METHOD_WARP_VIRTUAL_WORK,
// since both have the same modes. A step under gravity visits no vertex. The first state of a model
// prepares it, which takes as long as a part of the precompute, on small meshes up to twice as
// long; the model then holds 3 more numbers a vertex and sample, of which there are at most 32.
// turn_in_range of sw_state_report up to half a turn.
#define SW_METHOD_ROTATION_STRAIN 8
// The method that the precompute chose for the scene by auto_error, auto_operations or both: see
// SwPrecomputeDesc. Without these, of a model with a reduced shell, by reduced_fields or
// SW_PRECOMPUTE_AUTO: SW_METHOD_POLYNOMIAL_SHELL where it met the training's equilibria as well as
// SW_METHOD_REDUCED_SHELL; SW_METHOD_ADAPTIVE_SHELL where it did so up to a quarter of their size
// or more; else SW_METHOD_REDUCED_SHELL. Of any other model what 0 stands for, the warp. With
// SW_PRECOMPUTE_AUTO_FULL it is SW_METHOD_SHELL_IMPLICIT where fields do not hold the shell, by
// steps of second order whatever integrator is asked for.
#define SW_METHOD_AUTO 7

// Modes: any precompute.
#define SW_NEEDS_MODES 1
// Modal rotations: a precompute without SW_PRECOMPUTE_LINEAR.
#define SW_NEEDS_ROTATIONS 2
// Fields: a precompute with reduced_fields.
#define SW_NEEDS_REDUCED_FIELDS 3
// Something to choose from: a precompute with SW_PRECOMPUTE_AUTO, auto_error, auto_operations or
// reduced_fields. On other models SW_METHOD_AUTO is the warp.
#define SW_NEEDS_CHOICE 4

// Number of methods that this library knows, SW_METHOD_AUTO included.
uint32_t sw_method_count(void);

// The SW_METHOD_... at `index` of the table, in the order for menus; SW_METHOD_AUTO is the last. 0
// at and beyond sw_method_count().
uint32_t sw_method_at(uint32_t index);

// A method's name for files and scripts, such as "warp-virtual-work". Lower case, parted by
// hyphens; it never changes. "" for an unknown number. Never NULL; constant.
const char *sw_method_name(uint32_t method);

// A method's name for menus, such as "Warp by virtual work". "" for an unknown number. Never NULL;
// constant.
const char *sw_method_label(uint32_t method);

// What a model must have for states of a method, SW_NEEDS_.... 0 for an unknown number.
uint32_t sw_method_needs(uint32_t method);

// Whether states of a method can be made on a model: SW_OK, or the error that sw_state_create would
// give. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT for an unknown method, SW_ERROR_NOT_PRECOMPUTED,
// SW_ERROR_UNSUPPORTED, SW_ERROR_BUSY.
SwStatus sw_model_offers(const struct SwModel *model,
                         uint32_t method);

/* States --------------------------------------------------------------------------------------- */

// Backward Euler: first order, stable for every step, damps what the step does not resolve.
#define SW_INTEGRATOR_IMPLICIT_EULER 1
// The closed-form motion of each mode under a force constant over the step: no numerical damping of
// its own.
#define SW_INTEGRATOR_EXACT 2
// Second order: two implicit stages of the full shell. They cost two to three steps of backward
// Euler and calm nothing that the step resolves. A step among contacts, on a rest shape that moves,
// or that lets a stretched shell go is one of backward Euler. Modal methods take
// SW_INTEGRATOR_EXACT for it; reduced shells are of second order always.
#define SW_INTEGRATOR_SECOND_ORDER 3

// The state gives the same bits on every processor and platform, on one saved model: its kernels
// multiply and add in two roundings, and nothing that differs from platform to platform is called.
// A step by modes takes up to 1.3 times as long, one of a reduced shell two to five times. It holds
// for what sw_state_step, sw_state_equilibrium and the outputs give by all methods but
// SW_METHOD_SHELL_..., not for certificates, nor for which method sw_state_fall_back takes by them.
#define SW_STATE_DETERMINISTIC 1

// How a state moves.
typedef struct SwStateDesc {
  // Set by sw_state_desc_init.
  uint32_t struct_size;
  // SW_METHOD_...; 0 = SW_METHOD_WARP, or SW_METHOD_LMA on a model with SW_PRECOMPUTE_LINEAR.
  uint32_t method;
  // SW_INTEGRATOR_... of modal methods and SW_METHOD_SHELL_IMPLICIT; 0 =
  // SW_INTEGRATOR_IMPLICIT_EULER.
  uint32_t integrator;
  // SW_STATE_... or 0.
  uint32_t flags;
} SwStateDesc;

// Damping of each mode: c = xi + zeta lambda + 2 ratio sqrt(lambda); of SW_METHOD_SHELL_... xi M +
// zeta K. The full shell has no modes to damp one by one: ratios that are all alike add the xi that
// damps its slowest swing by this share, and others are refused. All must be finite and not
// negative; 0 = none. It may be stronger on some of the shell than on other parts, by factors at
// the vertices.
typedef struct SwDampingDesc {
  // Set by sw_damping_desc_init.
  uint32_t struct_size;
  // 0, 1 (one ratio for all modes) or the number of modes.
  uint32_t n_ratios;
  // Rayleigh's xi, 1/s.
  double mass_coefficient;
  // Rayleigh's zeta, s.
  double stiffness_coefficient;
  // Fractions of critical damping (n_ratios).
  const double *ratios;
  // What xi and the ratios are multiplied by at each vertex (n_factors), not negative, or NULL: 1
  // everywhere. The full shell has xi of each vertex, reduced shells what that is on their fields.
  // Modal methods, and ratios, have of each mode the mean over what moves in it: right where
  // damping is light. Reduced shells that move freely refuse them.
  const void *factors;
  // Bytes from factor to factor; 0 = packed.
  uint64_t factor_stride;
  // SW_FORMAT_... of factors.
  uint32_t factor_format;
  // 0, or the number of vertices.
  uint32_t n_factors;
} SwDampingDesc;

// The frame jumps to its new pose and is at rest there: no inertial load.
#define SW_FRAME_TELEPORT 1
// The velocities and accelerations of the descriptor are used instead of differences of poses.
#define SW_FRAME_MOTION_GIVEN 2

// A pose of the support frame, world = origin + rotation local, and optionally its motion, all in
// world axes.
typedef struct SwFrameDesc {
  // Set by sw_frame_desc_init.
  uint32_t struct_size;
  // SW_FRAME_... or 0. SW_FRAME_TELEPORT wins.
  uint32_t flags;
  // World position of the frame's origin.
  double origin[3];
  // Row-major rotation matrix, its columns the frame's axes in world space. All zero = identity.
  // Must be orthonormal to 1e-4 and right-handed; the nearest rotation is used.
  double rotation[9];
  // Velocity of the origin, read with SW_FRAME_MOTION_GIVEN only, as the three below.
  double velocity[3];
  // Acceleration of the origin.
  double acceleration[3];
  // Angular velocity, rad/s.
  double angular_velocity[3];
  // Angular acceleration, rad/s^2.
  double angular_acceleration[3];
} SwFrameDesc;

// A moving shell. Opaque. One thread at a time, but functions that take it const may run at the
// same time as each other; a violation returns SW_ERROR_BUSY.
typedef struct SwState SwState;

// Makes a state at rest on a precomputed model; `desc` may be NULL for defaults. No loads, no
// damping, the frame at the world's origin. The state keeps alive what it needs of the model.
// Callable concurrently on one model. On success *state is a new object, to be given to
// sw_state_destroy; on failure it is untouched.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_NOT_PRECOMPUTED,
// SW_ERROR_UNSUPPORTED for a warp or rotation-strain reconstruction on a model with
// SW_PRECOMPUTE_LINEAR, for SW_METHOD_REDUCED_SHELL on a model without reduced_fields and for
// SW_METHOD_AUTO on one without a choice, for SW_METHOD_SHELL_... with SW_STATE_DETERMINISTIC;
// SW_ERROR_NUMERICAL and SW_ERROR_OUT_OF_MEMORY where a method has to prepare itself,
// SW_ERROR_BUSY.
SwStatus sw_state_create(const struct SwModel *model,
                         const struct SwStateDesc *desc,
                         struct SwState **state);

// Destroys a state. NULL does nothing. An object must not be destroyed twice or during a call.
void sw_state_destroy(struct SwState *state);

// Back to rest and time 0. Loads, damping and constraints stay; the frame stays where it was last
// set, at rest.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUSY.
SwStatus sw_state_reset(struct SwState *state);

// Makes an independent copy, loads, damping and constraints included; stepping both alike gives the
// same bits. *clone is a new object.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
SwStatus sw_state_clone(const struct SwState *state,
                        struct SwState **clone);

// Sets when the state rests: it then skips its steps, which only let time pass, until something
// changes. With 0, as at first, it rests when a step has left every bit as it was, so that skipping
// the next changes none either. With a length, a modal state without handles rests as soon as what
// is left of its swing about the equilibrium of its present loads can move no vertex further than
// that (to first order); what is left is then dropped, and a state restored by sw_state_load may go
// on with other bits. Nonlinear shells, reduced or not, never rest.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUSY.
SwStatus sw_state_set_rest_tolerance(struct SwState *state,
                                     double tolerance);

// Sets gravity: 3 doubles, acceleration (length unit / s^2). It keeps its direction in the world,
// however the shell and the frame turn. 0 at first.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUSY.
SwStatus sw_state_set_gravity(struct SwState *state,
                              const double *gravity);

// Replaces all damping.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_UNSUPPORTED for ratios of
// SW_METHOD_SHELL_... and for factors of a reduced shell that moves freely, SW_ERROR_BUSY.
SwStatus sw_state_set_damping(struct SwState *state,
                              const struct SwDampingDesc *desc);

// Multiplies all stiffness by a factor, from 1e-9 to 1e9, from the next step on: of membrane,
// bending and creases alike, in every method, without a precompute. 1 at first; sw_state_reset
// leaves it. Shape and velocities stay. Frequencies go with the factor's root, ratios of critical
// damping stay, and a step costs as much as before. Meant for slow changes, such as a leaf that
// wilts: the energy jumps with the factor. A saved state is loaded by a state of the same factor.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUSY.
SwStatus sw_state_set_stiffness(struct SwState *state,
                                double factor);

// Sets the factor of sw_state_set_stiffness by which the slowest mode that swings has this
// frequency: the square of what it is over the frequency of sw_model_frequencies. *factor is then
// that factor; `factor` may be NULL.
// Errors: SW_ERROR_INVALID_ARGUMENT, also where no mode swings or the factor is outside of its
// range; SW_ERROR_BUSY.
SwStatus sw_state_set_frequency(struct SwState *state,
                                double hertz,
                                double *factor);

// Sets the factor of sw_state_set_stiffness by which the shell sags so far: the vertex that moves
// furthest is then `length` from where it rests without load, in the equilibrium of the present
// gravity and loads. The state is there then, as after sw_state_equilibrium. By the state's own
// method, and so as near as that is: take SW_METHOD_SHELL_IMPLICIT for a stiffness that all methods
// share. Takes three to six equilibria, more where the first are not found. `tolerance` is relative
// to `length`; 0 = 0.01. *factor is then that factor; `factor` may be NULL. Allocates. Errors,
// which change nothing: SW_ERROR_INVALID_ARGUMENT, also where nothing moves, no factor is found by
// which it sags so far, or only one by which an edge stretches to more than twice its length; as
// sw_state_equilibrium.
SwStatus sw_state_set_sag(struct SwState *state,
                          double length,
                          double tolerance,
                          double *factor);

// Sets where the support frame is at the end of the next step; call it before each step while the
// frame moves. It stays where it is when not called. The first call after creation or reset, before
// any step, simply places the frame.
//
// The shell feels gravity less the frame's acceleration, and the Euler, centrifugal and Coriolis
// forces of its rotation.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_BUSY.
SwStatus sw_state_set_frame(struct SwState *state,
                            const struct SwFrameDesc *desc);

// Sets modal amplitudes and their rates (count each, count = number of modes); unit: length times
// sqrt(mass).
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_UNSUPPORTED by a nonlinear shell, reduced or not,
// SW_ERROR_NUMERICAL when vertices would turn by more than 1e6 rad, SW_ERROR_BUSY.
SwStatus sw_state_set_amplitudes(struct SwState *state,
                                 const double *amplitudes,
                                 const double *velocities,
                                 uint32_t count);

// Poses the shell: takes the nearest motion that the state's method has. `positions` and
// `velocities` (n_vertices x 3) are of all vertices, in the order of the mesh, in SW_SPACE_... and
// as SW_FORMAT_..., `stride` and `velocity_stride` bytes from vertex to vertex (0 = packed). NULL
// velocities mean at rest in the support frame. The world's are as in sw_state_positions: the frame
// is where it was at the end of the last step, and velocities contain its own. Nearest is meant in
// the mass norm. `missed` (or NULL) gets what is left: the root mean square distance of the
// vertices from `positions`, weighted by mass, in the mesh's unit. Nonlinear shells take every
// vertex that moves; held and unreferenced vertices stay. Modes and fields seldom have the pose
// itself. Positions read in SW_FORMAT_F64 and set again come back within 1e-6 of the largest
// displacement, with SW_PRECISION_F64 within 1e-9. Modal methods search from rest: of a pose turned
// by more than two radians they may find another, which `missed` shows. Time, frame, loads, damping
// and constraints stay. Takes as long as hundreds of readings of the positions. Allocates. On
// failure nothing has changed.
// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the mesh's, on a number that is
// not finite, and on a vertex more than 1e6 sizes of the mesh from rest or faster than 1e15 of them
// a second; SW_ERROR_NUMERICAL when the method cannot tell the pose; SW_ERROR_OUT_OF_MEMORY,
// SW_ERROR_BUSY.
SwStatus sw_state_set_pose(struct SwState *state,
                           uint32_t space,
                           uint32_t format,
                           const void *positions,
                           uint64_t stride,
                           const void *velocities,
                           uint64_t velocity_stride,
                           uint32_t n_vertices,
                           double *missed);

// Modal amplitudes q and rates. Two calls: with both pointers NULL and `capacity` 0 only *count is
// written.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_UNSUPPORTED by a nonlinear shell, reduced or not,
// SW_ERROR_BUFFER_SIZE when capacity < *count, SW_ERROR_BUSY.
SwStatus sw_state_amplitudes(const struct SwState *state,
                             double *amplitudes,
                             double *velocities,
                             uint32_t capacity,
                             uint32_t *count);

// Advances by `seconds` > 0; any step, changing from call to call. Modal methods do not allocate.
// On failure nothing has moved. Loads that would bend a modal method's shell beyond half a turn
// meet a growing resistance, which ordinary scenes never feel: whatever the load, the root of the
// sum of squares of the elastic modes' largest turns stays below three quarters of a turn. So no
// vertex turns further than that times the root of their number; only handles and
// sw_state_set_amplitudes may turn it on. Without loads and handles a modal method's energy never
// grows. A step by SW_METHOD_SHELL_IMPLICIT takes at most 2000 linear solves, with all that handles
// and colliders need.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_NUMERICAL when the result would leave the range of
// numbers (turns of 1e6 rad) or the step of a nonlinear shell is not found, SW_ERROR_BUSY.
SwStatus sw_state_step(struct SwState *state,
                       double seconds);

// Saves the dynamic state (time, frame, amplitudes and rates, constraint work): 152 bytes and 16 a
// mode, or mode and field of a reduced shell, so 952 at 50 modes; 152 and 48 a vertex of a
// nonlinear shell; with colliders 16 more, 56 a collider and 48 a contact; with a rest shape that
// moves 40 more and 104 a vertex; and 16 a crease that yields. Loads, damping and constraints are
// inputs and not saved. Two calls: with `bytes` NULL and `capacity` 0 only *size is written.
// Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *size, SW_ERROR_BUSY.
SwStatus sw_state_save(const struct SwState *state,
                       void *bytes,
                       uint64_t capacity,
                       uint64_t *size);

// Restores what sw_state_save gave of a state of the same method, on a model made from the same
// inputs; the run then goes on with the same bits. Safe on any bytes: they carry a version, the
// method, sizes, the model's fingerprint and a checksum. Bytes of format version 1 did not say
// their method and are refused. On failure nothing has changed. A pose set for the next step is
// dropped: set it after loading.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DATA, SW_ERROR_BUSY.
SwStatus sw_state_load(struct SwState *state,
                       const void *bytes,
                       uint64_t size);

/* Supports that move --------------------------------------------------------------------------- */

// The supports are there without having moved: nothing feels inertia of it.
#define SW_SUPPORTS_TELEPORT 1

// Sets where supported vertices are at the end of the next step, each on a path of its own; call it
// before each step while they move. They stay where they are when not called. `positions`
// (n_vertices x 3, world space) has a row for every vertex in the order of the mesh, as
// SW_FORMAT_..., `stride` bytes from vertex to vertex (0 = packed); only rows of supports (fixed
// and clamped vertices, with the neighbours that these need) are read. The first call after
// creation or reset, before any step, simply places them. `flags`: SW_SUPPORTS_TELEPORT or 0.
//
// The support frame is set to the rigid motion nearest to them, as by sw_state_set_frame, with its
// inertia: rows may move and turn as one, however far, by every method. What is left of their
// motion bends the shell: SW_METHOD_WARP, SW_METHOD_WARP_VIRTUAL_WORK and SW_METHOD_LMA follow it
// by the model's support_fields (SwPrecomputeDesc), with the inertia of that; nonlinear shells, not
// reduced, follow exactly. Other methods return SW_ERROR_UNSUPPORTED when it is more than 1e-5 of
// the model's size. Supports are shown where they are; SwStateReport's support_miss is how far the
// fields are from that.
//
// A later sw_state_set_frame moves the supports along, in the frame as they are. Modes do not know
// that a sheet which is pushed together buckles: sw_state_certify shows it.
// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the mesh's or the shell has no
// supports; SW_ERROR_UNSUPPORTED, see above; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY. A support must
// be finite, and within 1e6 sizes of the mesh of the rigid motion. On failure nothing has changed.
SwStatus sw_state_move_supports(struct SwState *state,
                                uint32_t format,
                                const void *positions,
                                uint64_t stride,
                                uint32_t n_vertices,
                                uint32_t flags);

// The rest shape is there without having moved: nothing feels inertia of it.
#define SW_REST_TELEPORT 1

// Sets where the rest shape is at the end of the next step, as the host animates it by blend shapes
// or a skeleton; call it before each step while it moves. `positions` (n_vertices x 3, world space)
// has a row for every vertex in the order of the mesh, as SW_FORMAT_..., `stride` bytes from vertex
// to vertex (0 = packed); NULL with n_vertices 0: the mesh is the rest shape again. `flags`:
// SW_REST_TELEPORT or 0. The first call places it.
//
// The method's displacement from the mesh is added to the shape, turned at each vertex by the mean
// rotation of its triangles. Gravity, forces, wind and the inertia of the shape's motion act in
// these axes. Supports go with the shape, exactly. Nothing is precomputed anew: a shape that is
// bent or stretched far from the mesh has another stiffness, which the modes do not know;
// rest_stretch of SwStateReport tells the largest change of an edge. The full shells take lengths
// and angles at rest from the shape, with the mesh's masses: they are the shell of that shape. The
// support frame then is for output in SW_SPACE_FRAME alone. Colliders touch what is shown, and
// targets of constraints are where it is shown. It is saved with the state; a state saved before it
// moved leaves it, when loaded, where it was sent last, at rest.
// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the mesh's, or a vertex is not
// finite or beyond 1e9 sizes of the mesh; SW_ERROR_UNSUPPORTED with sag_gravity, zero modes or
// supports that moved by themselves, and by a full shell with a shape without stress or rest angles
// of its own, creases that yield or planes of symmetry. Its step fails with SW_ERROR_NUMERICAL
// where a triangle of the shape has no area; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY. On failure
// nothing has changed. While it moves, supports that move by themselves and poses are refused. So
// are certificates and corrections: to judge a pose, go on by a full shell.
SwStatus sw_state_move_rest(struct SwState *state,
                            uint32_t format,
                            const void *positions,
                            uint64_t stride,
                            uint32_t n_vertices,
                            uint32_t flags);

/* What a state shows --------------------------------------------------------------------------- */

// World axes and origin.
#define SW_SPACE_WORLD 0
// Axes and origin of the support frame.
#define SW_SPACE_FRAME 1

// Measures of a state. The caller sets struct_size with sw_state_report_init.
typedef struct SwStateReport {
  // Set by sw_state_report_init.
  uint32_t struct_size;
  // Of rotations alone, and no measure of the error, which sw_state_certify estimates: 1 while
  // max_rotation is at most a quarter turn, where the warp itself gets a fifth of a strip's
  // displacement wrong, or half a turn with SW_METHOD_ROTATION_STRAIN; always 1 for a nonlinear
  // shell, reduced or not. 1 does not mean that the pose is right: on curved shells modes are most
  // of the error.
  uint32_t turn_in_range;
  // Seconds stepped since creation or reset.
  double time;
  // Of the motion in the frame. Under handles SW_INTEGRATOR_EXACT moves by impulses at the start of
  // each step: a shell that rests at the ends of steps reports the energy of half an impulse there,
  // which falls with the square of the step.
  double kinetic_energy;
  // Of the deformation; of modal methods also that of the resistance to bends beyond half a turn,
  // see sw_state_step.
  double elastic_energy;
  // Work done on the shell by constraints since creation or reset.
  double constraint_work;
  // Largest rotation of a vertex, rad: |w| of modal methods, which counts turns; at most half a
  // turn of nonlinear shells. A modal method on a model with SW_PRECOMPUTE_LINEAR computes it from
  // the displacements at each call.
  double max_rotation;
  // Largest displacement in the frame.
  double max_displacement;
  // Of all vertices, the share turned further than turn_in_range allows. Of rotations alone, too.
  double fraction_turned_too_far;
  // Steps of a reduced shell since creation or reset, as this object took them, whose Newton search
  // ended short of its tolerance: finite, but less accurate than the others; shorter steps help. 0
  // for other methods.
  uint64_t unconverged_steps;
  // Contacts with colliders that had a force at the end of the last step or equilibrium.
  uint64_t contact_count;
  // Of any vertex, how far it was inside a collider and its thickness then; 0 outside. What modes
  // or fields cannot follow stays.
  double deepest_penetration;
  // Of the colliders on the shell over the last step, world axes.
  double contact_impulse[3];
  // How far any support that moved is from where the model's support_fields have it, length: by so
  // much the shell is bent beside it. More fields make it less. 0 where none moved, and for
  // nonlinear shells.
  double support_miss;
  // Largest change of an edge's length from the mesh to the rest shape that sw_state_move_rest sent
  // last, a share; 0 without one.
  double rest_stretch;
  // Estimate of what the last step of a reduced, polynomial or full shell got wrong by its length:
  // root mean square displacement by mass, length. Of reduced shells it is from their own stages,
  // and falls with the cube of the step, with the square where the shell touches. Of the full shell
  // it is h²/2 times the acceleration, and falls with the square. Errors of steps add up at most,
  // and damping takes them back. Not of fields or loads, which sw_state_certify tells. 0 before a
  // step and for other methods.
  double step_error;
} SwStateReport;

// Deformed positions (n_vertices x 3) in SW_SPACE_..., as SW_FORMAT_..., `stride` bytes from vertex
// to vertex (0 = packed). Order and number of vertices are those of the mesh. Callable
// concurrently. At rest in an unmoved frame they are the mesh's own to the last bit, with
// sag_gravity those of the hanging shape. SW_FORMAT_F64 adds the displacement to the mesh's
// positions and places the sum in 64 bits. SW_FORMAT_F32 is the faster: with SW_PRECISION_F32 all
// of it is done in 32 bits, good to four units in the last place of the largest coordinate among
// rest positions, frame origin and result.
// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the mesh's; SW_ERROR_NUMERICAL
// when a coordinate of any vertex, in the frame or in the space asked for, exceeds 8.5e37 in
// SW_FORMAT_F32 or the numbers of SW_FORMAT_F64; SW_ERROR_BUSY.
SwStatus sw_state_positions(const struct SwState *state,
                            uint32_t space,
                            uint32_t format,
                            void *out,
                            uint64_t stride,
                            uint32_t n_vertices);

// The positions of some vertices (n x 3), in the order of the list `vertices` (n; nothing is read
// or written for 0), otherwise as sw_state_positions and with the same bits: what is seen, a proxy,
// a render region. Costs as much as the blocks of 16 vertices that these lie in; a list in
// ascending order visits each block once. Callable concurrently.
// Errors: as sw_state_positions; SW_ERROR_INVALID_ARGUMENT also on a vertex that does not exist.
SwStatus sw_state_positions_of(const struct SwState *state,
                               uint32_t space,
                               uint32_t format,
                               const uint32_t *vertices,
                               uint32_t n,
                               void *out,
                               uint64_t stride);

// Area-weighted unit normals of the deformed shell (n_vertices x 3), as sw_state_positions; zero at
// unreferenced vertices. They follow the orientation of the mesh's triangles, as re-oriented where
// these disagree. Allocates.
// Errors: as sw_state_positions, SW_ERROR_OUT_OF_MEMORY; SW_ERROR_NUMERICAL when a normal cannot be
// told.
SwStatus sw_state_normals(const struct SwState *state,
                          uint32_t space,
                          uint32_t format,
                          void *out,
                          uint64_t stride,
                          uint32_t n_vertices);

// Rotation of each vertex's frame from rest (exp of its modal rotation, or the mean of its
// triangles'), as unit quaternions w x y z (n_vertices x 4), for hosts that carry tangent frames,
// hair or instances along. Otherwise as sw_state_positions.
// Errors: as sw_state_positions, SW_ERROR_UNSUPPORTED for a modal method on a model with
// SW_PRECOMPUTE_LINEAR.
SwStatus sw_state_rotations(const struct SwState *state,
                            uint32_t space,
                            uint32_t format,
                            void *out,
                            uint64_t stride,
                            uint32_t n_vertices);

// Energies, and how far the shell is bent. `report` must be initialised by sw_state_report_init.
// Visits every vertex, so costs as much as reading the positions. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_NUMERICAL when a measure
// leaves the range of numbers, SW_ERROR_BUSY.
SwStatus sw_state_report(const struct SwState *state,
                         struct SwStateReport *report);

/* Points that follow a shell ------------------------------------------------------------------- */

// Points to be bound to a shell's mesh: the vertices of another mesh that is drawn, or any other
// points.
typedef struct SwBindingDesc {
  // Set by sw_binding_desc_init.
  uint32_t struct_size;
  // Must be 0.
  uint32_t flags;
  // SW_FORMAT_... of all three arrays.
  uint32_t format;
  // Length of each array given. At least 1.
  uint32_t n_points;
  // Where the points are while the mesh is as sw_model_create was given it, in its axes (n_points x
  // 3).
  const void *points;
  // Bytes from point to point; 0 = packed.
  uint64_t point_stride;
  // Normals there (n_points x 3), of any length but 0. NULL: none can be read.
  const void *normals;
  // Bytes from normal to normal; 0 = packed.
  uint64_t normal_stride;
  // Tangents there (n_points x 3); with normals, the part across these counts. NULL: none can be
  // read.
  const void *tangents;
  // Bytes from tangent to tangent; 0 = packed.
  uint64_t tangent_stride;
  // A point further from the mesh is refused; 0 = any up to a million sizes of the mesh.
  double max_distance;
} SwBindingDesc;

// What a binding has.
typedef struct SwBindingInfo {
  // Set by sw_binding_info_init.
  uint32_t struct_size;
  // Number of points.
  uint32_t n_points;
  // 1 if it was made with normals.
  uint32_t has_normals;
  // 1 if it was made with tangents.
  uint32_t has_tangents;
  // Of the point furthest from the mesh, its distance.
  double furthest_distance;
  // Which point that is.
  uint32_t furthest_point;
  // Always 0.
  uint32_t reserved;
  // Memory that it holds.
  uint64_t bytes;
} SwBindingInfo;

// Which points to read, and where their values go. NULL arrays are left out.
typedef struct SwBoundPointsDesc {
  // Set by sw_bound_points_desc_init.
  uint32_t struct_size;
  // SW_SPACE_....
  uint32_t space;
  // SW_FORMAT_... of all arrays.
  uint32_t format;
  // SW_BOUND_OUTSIDE or 0.
  uint32_t flags;
  // The first point to read.
  uint32_t first;
  // So many points; 0 = all from `first` on.
  uint32_t count;
  // Where they are (count x 3).
  void *positions;
  // Bytes from position to position; 0 = packed.
  uint64_t position_stride;
  // Unit normals of what is drawn (count x 3).
  void *normals;
  // Bytes from normal to normal; 0 = packed.
  uint64_t normal_stride;
  // Unit tangents (count x 3).
  void *tangents;
  // Bytes from tangent to tangent; 0 = packed.
  uint64_t tangent_stride;
  // Velocities, length unit / s, for motion blur (count x 3).
  void *velocities;
  // Bytes from velocity to velocity; 0 = packed.
  uint64_t velocity_stride;
  // Newton steps of the full nonlinear shell, 0 to 100, or SW_STEPS_AUTO: points follow
  // sw_state_positions_corrected. Not with SW_BOUND_OUTSIDE, beside which SW_STEPS_AUTO is 0.
  uint32_t correction_steps;
  // Must be 0.
  uint32_t reserved;
  // With SW_BOUND_OUTSIDE, how deep the deepest of the points read still is: 0 but between
  // colliders that leave no room. NULL: not told.
  double *deepest;
} SwBoundPointsDesc;

// For the eye: points follow sw_state_positions_outside, and those that are inside a collider yet,
// such as points off the surface, leave it the shortest way.
#define SW_BOUND_OUTSIDE 1

// Points bound to a mesh. Immutable. Share it by any number of states and threads.
typedef struct SwBinding SwBinding;

// Binds points to a model's mesh, precomputed or not. On success *binding is a new object, to be
// given to sw_binding_destroy; on failure it is untouched. It stays as it is when the model is
// precomputed anew or destroyed.
//
// A point follows the triangle that it stands on, along normals that turn smoothly from vertex to
// vertex: by a surface with continuous normals through the deformed vertices, and off it with their
// turn. So positions of coarse triangles give no creases. At rest points are where they were given
// to the last bit; a rigid motion carries them rigidly; displacements are good to 1e-6 of
// themselves. With sag_gravity points are bound to the mesh as given, and hang with it. Takes about
// a microsecond a point. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, also on a point that is not finite or too far off, and a
// normal or tangent without direction; SW_ERROR_INVALID_DESC; SW_ERROR_NUMERICAL where the mesh is
// too thin or sharp to bind to; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
SwStatus sw_binding_create(const struct SwModel *model,
                           const struct SwBindingDesc *desc,
                           struct SwBinding **binding);

// Destroys a binding; NULL is ignored. No state uses it between calls.
void sw_binding_destroy(struct SwBinding *binding);

// What a binding has. `info` must be initialised by sw_binding_info_init. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC.
SwStatus sw_binding_info(const struct SwBinding *binding, struct SwBindingInfo *info);

// Saves a binding, so that sw_binding_load gives it back without the search. Two calls: with
// `bytes` NULL and `capacity` 0 only *size is written. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *size,
// SW_ERROR_OUT_OF_MEMORY.
SwStatus sw_binding_save(const struct SwBinding *binding,
                         void *bytes,
                         uint64_t capacity,
                         uint64_t *size);

// Makes a binding of what sw_binding_save gave, for a model of the same mesh. Safe on any bytes. On
// success *binding is a new object, to be given to sw_binding_destroy; on failure it is untouched.
// Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DATA, also where the bytes belong to another
// mesh; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
SwStatus sw_binding_load(const struct SwModel *model,
                         const void *bytes,
                         uint64_t size,
                         struct SwBinding **binding);

// Reads points of a binding, as the state's shell is now: positions, normals, tangents and
// velocities of one formula. Costs the same whatever the method and the number of modes: what
// reading the mesh's positions costs, and some nanoseconds a point. Many points are shared among
// threads, see sw_set_threads, to the same bits. In SW_SPACE_WORLD velocities contain the frame's.
// Allocates. Callable concurrently.
//
// With correction_steps or SW_BOUND_OUTSIDE points follow the surface that is corrected or pushed
// out, by the same formula: normals and tangents are its own. Velocities are of the motion alone,
// as that surface turns them: what correction and push change from frame to frame is not in them.
// SW_BOUND_OUTSIDE leaves no point inside a collider by more than 1e-6 of the mesh's size, by the
// collider's own distance and thickness, but for those on triangles that supports hold, and where
// *deepest tells; a point that went out by itself keeps its normal.
// Errors: SW_ERROR_INVALID_ARGUMENT, also on points that do not exist and a binding to another
// mesh; SW_ERROR_INVALID_DESC; SW_ERROR_UNSUPPORTED for normals or tangents of a binding made
// without; SW_ERROR_NUMERICAL when a point may be beyond the numbers of the format;
// SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY. Then nothing is written.
SwStatus sw_state_bound_points(const struct SwState *state,
                               const struct SwBinding *binding,
                               const struct SwBoundPointsDesc *desc);

/* A mesh to simulate in another's place -------------------------------------------------------- */

// Cut the asset where it is no manifold: edges of more than two triangles, sheets that touch in a
// point, strips with one side. What was cut is free to part.
#define SW_PROXY_CUT 1
// Simulate both sides of a sheet with thickness.
#define SW_PROXY_KEEP_SIDES 2
// Leave no piece out, however small.
#define SW_PROXY_KEEP_PIECES 4

// What proxy is wanted.
typedef struct SwProxyDesc {
  // Set by sw_proxy_desc_init.
  uint32_t struct_size;
  // Bitwise or of SW_PROXY_...
  uint32_t flags;
  // Vertices of the proxy, 4 to 4,000,000. It gets within some per cent of them; more where the
  // asset has more holes, lines or pieces than so few can follow.
  uint32_t n_vertices;
  // Must be 0.
  uint32_t reserved;
  // Vertices of the asset within this distance become one; 0 = those at the same place.
  double weld;
  // Two sides no further apart become the sheet in their middle, and where they cannot be told
  // apart is an error. 0 = sheets no thicker than a 20th of the asset's size and a tenth of the
  // piece's are found, and the rest is simulated as it is.
  double thickness;
  // Hears of progress, with 0 for the phase; may be NULL.
  SwProgressFn progress;
  // Handed to it.
  void *progress_user;
  // Vertices of the asset that supports hold (n_held): the outline of what they hold is kept where
  // it is wide enough for the proxy's triangles, so that as much of the proxy is held. Of
  // sw_proxy_nearest these are the proxy's vertices to be held. NULL = none.
  const uint32_t *held;
  // Length of held.
  uint32_t n_held;
  // Must be 0.
  uint32_t held_flags;
} SwProxyDesc;

// What was done to an asset, and what came out.
typedef struct SwProxyInfo {
  // Set by sw_proxy_info_init.
  uint32_t struct_size;
  // Vertices of the proxy.
  uint32_t n_vertices;
  // Triangles of the proxy.
  uint32_t n_triangles;
  // Pieces of the proxy that do not hang together.
  uint32_t n_pieces;
  // Vertices of the asset.
  uint32_t n_asset_vertices;
  // Pieces of the asset left out, as they are less than three edges of the proxy across. Bound to
  // the proxy, they follow it.
  uint32_t n_left_out;
  // Vertices of the asset made one with another.
  uint32_t n_welded;
  // Triangles of the asset left out as another has the same corners.
  uint32_t n_repeated;
  // Triangles of the asset left out as second sides and rims.
  uint32_t n_sides_joined;
  // Places where the asset was cut, with SW_PROXY_CUT.
  uint32_t n_cut;
  // Of the asset's vertices that the proxy stands for, the one furthest from it.
  uint32_t furthest_vertex;
  // Holes closed, as they are less than three edges of the proxy around.
  uint32_t n_holes_closed;
  // Its distance; with sides joined, from where their middle was.
  double furthest_distance;
  // Length of edges aimed at.
  double edge_length;
  // Between sides that were joined; 0 = none were.
  double thickness;
  // 4 sqrt(3) area / sum of squared sides, 1 for equilateral triangles: of the worst.
  double worst_quality;
  // The mean of all triangles.
  double mean_quality;
} SwProxyInfo;

// A mesh to simulate in an asset's place. Immutable. Share it by any number of threads.
typedef struct SwProxy SwProxy;

// Makes a mesh of a wanted number of vertices to simulate in an asset's place, whatever that is
// made of: triangles in any order and number, loose, double-sided, with thickness, in pieces. On
// success *proxy is a new object, to be given to sw_proxy_destroy; on failure it is untouched. Make
// a model of its positions and triangles, and bind the asset's vertices to that by
// sw_binding_create.
//
// Triangles are close to equilateral, boundaries and creases are kept, and the result is an
// oriented manifold. Takes about 0.15 s for 10,000 triangles. The same input gives the same proxy.
// Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT; SW_ERROR_INVALID_DESC; SW_ERROR_INVALID_MESH with the place
// and what to do, where the asset is no manifold or its two sides cannot be told apart;
// SW_ERROR_CANCELLED; SW_ERROR_NUMERICAL where no good triangles were found;
// SW_ERROR_OUT_OF_MEMORY.
SwStatus sw_proxy_create(const struct SwMeshDesc *mesh,
                         const struct SwProxyDesc *desc,
                         struct SwProxy **proxy);

// Destroys a proxy; NULL is ignored.
void sw_proxy_destroy(struct SwProxy *proxy);

// What a proxy has, and what was done to the asset. `info` must be initialised by
// sw_proxy_info_init. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC.
SwStatus sw_proxy_info(const struct SwProxy *proxy,
                       struct SwProxyInfo *info);

// Positions of a proxy's vertices (n_vertices x 3) in the asset's axes and lengths, as
// SW_FORMAT_..., `stride` bytes from vertex to vertex (0 = packed). Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the proxy's.
SwStatus sw_proxy_positions(const struct SwProxy *proxy,
                            uint32_t format,
                            void *positions,
                            uint64_t stride,
                            uint32_t n_vertices);

// Triangles of a proxy (n_triangles x 3), packed. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_triangles is not the proxy's.
SwStatus sw_proxy_triangles(const struct SwProxy *proxy, uint32_t *triangles, uint32_t n_triangles);

// Where each vertex of a proxy lies on the asset: three of its vertices and their weights, of sum 1
// (n_vertices x 3 each, packed). By these painted values, groups and colours come to the proxy.
// Either may be NULL. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_vertices is not the proxy's.
SwStatus sw_proxy_sources(const struct SwProxy *proxy,
                          uint32_t *vertices,
                          double *weights,
                          uint32_t n_vertices);

// Of each vertex of the asset, the nearest of the proxy (n_asset_vertices); 0 of one in no
// triangle. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, also when n_asset_vertices is not the asset's.
SwStatus sw_proxy_nearest(const struct SwProxy *proxy,
                          uint32_t *vertices,
                          uint32_t n_asset_vertices);

// How a model is calibrated.
typedef struct SwCalibrationDesc {
  // Set by sw_calibration_desc_init.
  uint32_t struct_size;
  // Must be 0.
  uint32_t flags;
  // Hears of progress, with 0 for the phase; may be NULL.
  SwProgressFn progress;
  // Handed to it.
  void *progress_user;
  // Vertices of the asset that supports hold (n_held). NULL = those that the proxy was made with.
  const uint32_t *held;
  // Length of held.
  uint32_t n_held;
  // Must be 0.
  uint32_t reserved;
} SwCalibrationDesc;

// What a calibration found.
typedef struct SwCalibrationInfo {
  // Set by sw_calibration_info_init.
  uint32_t struct_size;
  // Patches of the proxy that have factors of their own, each between 1/4 and 4; between patches
  // these change smoothly.
  uint32_t n_patches;
  // Vertices of the mesh that it was compared with: the asset's, or of a finer proxy where these
  // are very many, or fewer than twice the proxy's.
  uint32_t n_compared;
  // Loads whose answers were compared: gravity along each axis, and loads that follow from these.
  uint32_t n_loads;
  // Under gravity along each axis, to first order: root mean square of how far the proxy's vertices
  // were off, relative to how far the asset moves there; before.
  double difference_before;
  // And after.
  double difference_after;
  // Least factor of the stiffness against stretching.
  double stretching_min;
  // Largest.
  double stretching_max;
  // Least factor of the stiffness against bending.
  double bending_min;
  // Largest.
  double bending_max;
  // The proxy's mass over the asset's, before.
  double mass_before;
} SwCalibrationInfo;

// Fits the stiffness of a model on a proxy's mesh so that it answers to gravity as the same sheet
// does on the asset, and gives it the asset's mass: what a coarse mesh gets wrong is mostly how
// stiff it is, and where. `model` is of the proxy's positions and triangles, the proxy was made
// with what supports hold as `held`, or the descriptor has it, and the model was not precomputed
// yet. `desc` may be NULL for defaults, `info` NULL if nothing is to be told.
//
// Each triangle's stiffness against stretching and against bending gets a factor, and so does its
// mass: the material has maps of triangles after that, which are saved with the model. Creases,
// ties and rest shapes are left out of the comparison, and stay as they are. With the paper's
// energy the asset is one whose k_length is less by its shorter edges. Takes one factorization of
// the asset's stiffness and about ten of the proxy's: about a second for an asset of 10,000
// vertices. On failure the model is as it was. Not to be called at the same time as any other
// function on this model.
// Errors: SW_ERROR_INVALID_ARGUMENT, also for a model of another mesh, one that was calibrated or
// precomputed before; SW_ERROR_INVALID_DESC; SW_ERROR_UNSUPPORTED where a piece of the proxy is not
// held, or nothing of the asset is; SW_ERROR_INVALID_MESH or SW_ERROR_NUMERICAL where the asset
// cannot be a shell; SW_ERROR_CANCELLED, SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
SwStatus sw_model_calibrate(struct SwModel *model,
                            const struct SwProxy *proxy,
                            const struct SwCalibrationDesc *desc,
                            struct SwCalibrationInfo *info);

/* Many states ---------------------------------------------------------------------------------- */

// Advances `count` states by `seconds` each, as sw_state_step would one by one and to the same
// bits, whatever the number of threads: states of any models and methods, in any order. A state
// that fails has not moved; the others have.
//
// `statuses` (count, or NULL) receives the status of each. The result is SW_OK, or the status of
// the first that failed, with its index in the message. A state that is in use is SW_ERROR_BUSY,
// and so is one that comes twice, at its later places.
//
// Little work is done on the calling thread alone. More is shared with threads of this library,
// made by the first call that needs them: one fewer than the processors that the process may use,
// see sw_set_threads. Allocates some bytes for each state. May run on several threads at once, on
// different states.
// Errors: SW_ERROR_INVALID_ARGUMENT when `states` or one of them is NULL: nothing has moved, and
// statuses is untouched. Else those of sw_state_step.
SwStatus sw_states_step(struct SwState *const *states,
                        uint32_t count,
                        double seconds,
                        SwStatus *statuses);

// Sets how many threads the library may use in this process, the calling one included: 1 for the
// calling one alone, 0 for as many as the process may use (the default), and no more than
// RAYON_NUM_THREADS of the environment where that is set. Threads share the states of
// sw_states_step, many bound points, and the work of steps, equilibria, certificates and
// precomputes on full shells of some thousand vertices, to the same bits on any number. Calls on
// several threads do not share among the same ones: the second works on its own. The library's
// threads end before this returns, and new ones are made when they are needed. Call it with 1
// before unloading the library where that takes its code away: on Windows and macOS. Elsewhere a
// closed library stays loaded.
// Errors: SW_ERROR_INVALID_ARGUMENT beyond 1024, SW_ERROR_BUSY while a call on another thread uses
// them.
SwStatus sw_set_threads(uint32_t count);

/* Constraints ---------------------------------------------------------------------------------- */

// Holds the vertex's position.
#define SW_CONSTRAINT_POSITION 1
// Holds the orientation of the vertex's frame (sw_state_rotations), which at rest is the support
// frame's.
#define SW_CONSTRAINT_ORIENTATION 2

// World x axis.
#define SW_AXIS_X 1
// World y axis.
#define SW_AXIS_Y 2
// World z axis.
#define SW_AXIS_Z 4

// Stands for every constraint in sw_state_clear_constraint.
#define SW_ALL_CONSTRAINTS 4294967295

// A handle (paper section 4.4). Position and orientation of one vertex are two constraints.
typedef struct SwConstraintDesc {
  // Set by sw_constraint_desc_init.
  uint32_t struct_size;
  // The host's number for it, below SW_ALL_CONSTRAINTS; setting a number again replaces the
  // constraint.
  uint32_t id;
  // SW_CONSTRAINT_.... Required.
  uint32_t kind;
  // Vertex held.
  uint32_t vertex;
  // SW_AXIS_... bits along or about which it holds; 0 = all.
  uint32_t axes;
  // Must be 0.
  uint32_t flags;
  // Displacement per force (length/force) or rotation per torque (rad/torque), not negative; 0 =
  // hard.
  double compliance;
  // World position (SW_CONSTRAINT_POSITION).
  double position[3];
  // World orientation, row-major rotation matrix as in SwFrameDesc (SW_CONSTRAINT_ORIENTATION); all
  // zero = identity. Of all rotation vectors that mean it the one nearest to the present is taken,
  // so a handle can be turned round and round.
  double rotation[9];
} SwConstraintDesc;

// What the last step made of a constraint. Output only.
typedef struct SwConstraintReport {
  // The host's number.
  uint32_t id;
  // SW_CONSTRAINT_....
  uint32_t kind;
  // Vertex held.
  uint32_t vertex;
  // 1 if the residual is at most a millionth of the model's size, or a microradian, beyond what the
  // compliance gives way. 0 before the first step.
  uint32_t met;
  // Linearizations that the whole set took in the last step.
  uint32_t iterations;
  // 0.
  uint32_t reserved;
  // What is missing along the held axes: length or rad.
  double residual;
  // Force or torque on the shell, world axes, over the last step.
  double force[3];
} SwConstraintReport;

// Adds a constraint, or moves or replaces the one with its id; it stays until cleared, and needs no
// new precompute. From the next step on the handle is where it was put (`met` in the report), or as
// near as the modes allow: constraints out of reach, at a vertex that a support holds, conflicting
// or more than the modes get the least-squares answer.
//
// A hard handle may ask for more than the shell can do gracefully: pushed along itself, a sheet
// that hardly stretches can only crumple. Near the rest pose it does not, and gets the
// least-squares answer; further away, ask sw_state_certify, hold only the axes that matter, or give
// a compliance.
//
// A nonlinear shell's handles are met exactly where supports and other handles leave the vertex
// free: a hard position is prescribed; where several want one vertex at different places it is at
// their mean. A step whose handles move too far for Newton's method to follow takes them a part of
// the way, and `met` is 0. The orientation is the mean of the triangles' rotations at the vertex.
// An explicit step sets positions, so a handle should move by little in each.
//
// Constraints are cloned with a state and survive its reset and loading, but are not saved.
// Allocates unless it replaces one of the same axes. A reduced shell follows hard handles as far as
// its fields can with a root mean square displacement of twice the model's size; it has the
// orientation of a nonlinear shell, and meets it as nearly as four passes of a step do, in an
// equilibrium to 1e-4 rad. Steps that hold one allocate.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_UNSUPPORTED for an orientation
// of a modal method on a model with SW_PRECOMPUTE_LINEAR, SW_ERROR_BUSY.
SwStatus sw_state_set_constraint(struct SwState *state,
                                 const struct SwConstraintDesc *desc);

// Removes a constraint, or all there are with SW_ALL_CONSTRAINTS.
// Errors: SW_ERROR_INVALID_ARGUMENT, also when there is none with this id; SW_ERROR_BUSY.
SwStatus sw_state_clear_constraint(struct SwState *state, uint32_t id);

// What the last step made of each constraint, by ascending id. `element_size` is
// sizeof(SwConstraintReport). Two calls: with `reports` NULL and `capacity` 0 only *count is
// written. Callable concurrently.
// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity <
// *count, SW_ERROR_BUSY.
SwStatus sw_state_constraint_report(const struct SwState *state,
                                    struct SwConstraintReport *reports,
                                    uint32_t element_size,
                                    uint32_t capacity,
                                    uint32_t *count);

/* Colliders ------------------------------------------------------------------------------------ */

// The half-space z <= 0.
#define SW_COLLIDER_PLANE 1
// A ball about the origin: radius.
#define SW_COLLIDER_SPHERE 2
// All points within radius of the segment from -half_length to half_length along z.
#define SW_COLLIDER_CAPSULE 3
// A box about the origin: half_extents.
#define SW_COLLIDER_BOX 4
// The convex hull of mesh->positions; its triangles are not read.
#define SW_COLLIDER_HULL 5
// The inside of a closed mesh, or what is behind one of SW_COLLIDER_ONE_SIDED, prepared as signed
// distances on a grid.
#define SW_COLLIDER_MESH 6

// The same of a mesh whose vertices move: sw_state_deform_collider. Its distances are exact, by a
// search for each point.
#define SW_COLLIDER_DEFORMING_MESH 7

// In SwColliderDesc, of SW_COLLIDER_MESH and SW_COLLIDER_DEFORMING_MESH: the mesh may be open, such
// as a ground, a wall of one skin or a body with a neck that is not closed. Its front is where its
// triangles run counterclockwise, and turned ones follow the most of their piece. It is solid
// behind by `depth`: at places whose nearest point of the mesh is in front of them, no farther than
// that, and not on its rim. So the front is right however sharp the mesh is bent, and what lies
// behind the solid at the start stays behind. A mesh that is closed and not inside out is what it
// is without the flag. Two parts of one mesh of which one's back is within `depth` of the other's
// front should be colliders of their own.
#define SW_COLLIDER_ONE_SIDED 2

// In sw_state_move_collider and sw_state_deform_collider: the collider is there at once and has no
// velocity.
#define SW_COLLIDER_TELEPORT 1

// A solid in axes of its own, which sw_state_move_collider places. Every collider is kinematic:
// only the host moves it, and no shell pushes it.
typedef struct SwColliderDesc {
  // Set by sw_collider_desc_init.
  uint32_t struct_size;
  // SW_COLLIDER_.... Required.
  uint32_t kind;
  // SW_COLLIDER_ONE_SIDED or 0.
  uint32_t flags;
  // Must be 0.
  uint32_t reserved;
  // Of a sphere or capsule, length, positive.
  double radius;
  // Of a capsule, length, not negative.
  double half_length;
  // Of a box, length, positive.
  double half_extents[3];
  // Coefficient of Coulomb's friction, not negative; 0 = none. About 0.3 to 0.6 for cloth and
  // leaves.
  double friction;
  // The shell stays so far off the surface, length, not negative; such as half its own thickness.
  double thickness;
  // Of SW_COLLIDER_HULL, SW_COLLIDER_MESH and SW_COLLIDER_DEFORMING_MESH, in the collider's axes;
  // copied.
  const struct SwMeshDesc *mesh;
  // Of SW_COLLIDER_MESH: cells along the longest side of the mesh, 4 to 2000; 0 = 64. A cell is
  // about the size of the finest feature.
  uint32_t cells;
  // Must be 0.
  uint32_t reserved2;
  // Of SW_COLLIDER_ONE_SIDED: how far behind its triangles the mesh is solid, length, from 1e-6 to
  // 100 times its longest side, of SW_COLLIDER_MESH two cells or more. 0 = four cells, of
  // SW_COLLIDER_DEFORMING_MESH a 16th of its longest side.
  double depth;
} SwColliderDesc;

// Where a collider is at the end of the next step.
typedef struct SwColliderPoseDesc {
  // Set by sw_collider_pose_desc_init.
  uint32_t struct_size;
  // SW_COLLIDER_TELEPORT or 0.
  uint32_t flags;
  // World position of its origin.
  double origin[3];
  // Row-major rotation matrix from its axes to the world's; all zero = identity.
  double rotation[9];
} SwColliderPoseDesc;

// Where the shell touched a collider at the end of the last step. Output only.
typedef struct SwContact {
  // A vertex three times, the ends of an edge and the second again, or the corners of a triangle.
  uint32_t vertices[3];
  // Which of the state's colliders.
  uint32_t collider;
  // Of the vertices: what touches is their mean by these.
  double weights[3];
  // Where it is, world space.
  double point[3];
  // Of the collider's surface, outward, of length 1.
  double normal[3];
  // From the surface with its thickness; negative inside.
  double gap;
  // On the shell, friction included, world axes.
  double force[3];
} SwContact;

// An immutable solid with its friction and thickness. Share it by any number of states and threads.
typedef struct SwCollider SwCollider;

// Makes a collider. On success *collider is a new object, to be given to sw_collider_destroy; on
// failure it is untouched. A mesh takes up to seconds, and about a megabyte at 64 cells. Triangles
// that are turned against their neighbours are taken as meant.
// Errors: SW_ERROR_INVALID_ARGUMENT, also on a size that is not from 1e-100 to 1e100, on
// SW_COLLIDER_ONE_SIDED of another kind and on a depth beyond its range; SW_ERROR_INVALID_DESC;
// SW_ERROR_INVALID_MESH on a mesh that is open or inside out without SW_COLLIDER_ONE_SIDED, or
// thinner than its cells, with the place.
SwStatus sw_collider_create(const struct SwColliderDesc *desc,
                            struct SwCollider **collider);

// Saves a collider, so that sw_collider_load gives it back without preparing its mesh again. Two
// calls: with `bytes` NULL and `capacity` 0 only *size is written. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity < *size.
SwStatus sw_collider_save(const struct SwCollider *collider,
                          void *bytes,
                          uint64_t capacity,
                          uint64_t *size);

// Makes a collider of what sw_collider_save gave. Safe on any bytes. On success *collider is a new
// object, to be given to sw_collider_destroy; on failure it is untouched.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DATA.
SwStatus sw_collider_load(const void *bytes,
                          uint64_t size,
                          struct SwCollider **collider);

// Destroys a collider. NULL does nothing. States that have it go on with it. An object must not be
// destroyed twice or during a call.
void sw_collider_destroy(struct SwCollider *collider);

// Replaces the colliders of a state; count 0 removes all. Each is in the world's axes until
// sw_state_move_collider, and is known by its place in the list. One that was in the same place
// before stays where it is. The list is copied; a collider may come more than once.
//
// Every method keeps its shell out of colliders: a step is taken in rounds, until no gap of a
// contact and no penetration is beyond 2e-5 of the mesh's size, at most twelve. So a step among
// colliders costs as many steps as it has rounds and a reading of the positions each; one that
// touches nothing costs one round. Vertices are looked at, and points between them where a collider
// is smaller than an edge. Vertices that a support holds pass through. A vertex that crosses a
// collider within a step, however fast, is stopped where it entered. One that begins a step inside
// comes out by at most the mesh's size a second. What a method's modes or fields cannot follow
// stays inside, and sw_state_report tells how deep. An explicit step feels a spring of its own
// vertex's mass instead. Friction is Coulomb's; an equilibrium has none. Contacts are cloned and
// saved with a state; colliders are cloned, survive its reset and loading, but are not saved.
// Allocates; steps of modal methods then do not.
// Errors: SW_ERROR_INVALID_ARGUMENT, also above 65536 colliders; SW_ERROR_UNSUPPORTED by a library
// without SW_FEATURE_CONTACT, SW_ERROR_BUSY.
SwStatus sw_state_set_colliders(struct SwState *state,
                                const struct SwCollider *const *colliders,
                                uint32_t count);

// Sets where a collider is at the end of the next step; it gets there evenly, and friction feels
// its velocity. It stays where it is when not called. The first call for a collider simply places
// it. sw_state_equilibrium has it there, at rest.
// Errors: SW_ERROR_INVALID_ARGUMENT, also where the state has no such collider;
// SW_ERROR_INVALID_DESC, SW_ERROR_BUSY.
SwStatus sw_state_move_collider(struct SwState *state,
                                uint32_t collider,
                                const struct SwColliderPoseDesc *desc);

// Sets the shape that a collider of SW_COLLIDER_DEFORMING_MESH has at the end of the next step:
// positions (n_vertices x 3) of its vertices in their order, in its axes, as SW_FORMAT_...,
// `stride` bytes apart (0 = packed). The triangles stay. What lies on it is taken along, and
// friction feels how it moves. It keeps the shape when not called. With SW_COLLIDER_TELEPORT it has
// it at once. The state takes a copy for its own the first time, so that states may share the
// collider; that copy is dropped by sw_state_set_colliders. The mesh should not meet itself.
// Errors: SW_ERROR_INVALID_ARGUMENT, also where the state has no such collider or it has another
// number of vertices; SW_ERROR_UNSUPPORTED of other kinds; SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
SwStatus sw_state_deform_collider(struct SwState *state,
                                  uint32_t collider,
                                  uint32_t flags,
                                  uint32_t format,
                                  const void *positions,
                                  uint64_t stride,
                                  uint32_t n_vertices);

// A capsule about points. Output only.
typedef struct SwCapsuleFit {
  // Set by sw_capsule_fit_init.
  uint32_t struct_size;
  // Always 0.
  uint32_t reserved;
  // Of a SwColliderDesc of SW_COLLIDER_CAPSULE.
  double radius;
  // The same.
  double half_length;
  // Of its SwColliderPoseDesc.
  double origin[3];
  // The same.
  double rotation[9];
} SwCapsuleFit;

// Fits a small capsule about points, such as the vertices of a bone: (n_points x 3) as
// SW_FORMAT_..., `stride` bytes apart (0 = packed). All are inside. `fit` must be initialised by
// sw_capsule_fit_init.
// Errors: SW_ERROR_INVALID_ARGUMENT, also where there is no point, where all are at one place or
// one is not within 1e100; SW_ERROR_INVALID_DESC.
SwStatus sw_fit_capsule(uint32_t format,
                        const void *points,
                        uint64_t stride,
                        uint32_t n_points,
                        struct SwCapsuleFit *fit);

// Finds where a shell is likely to be touched: vertices for contact_patches of SwPrecomputeDesc,
// before the precompute or after. Of those that move and rest no farther than `distance` from a
// collider's surface with its thickness, first the nearest, then each time the one farthest from
// those before, at most `capacity`. *count is how many there are; fewer where no others are near.
// Colliders (n_colliders) stand where poses (n_colliders x 12) say: an origin, then the row-major
// rotation matrix from the collider's axes, all zero = identity. NULL = all at the origin. The
// model's own axes are the world's. One that moves may come several times, with a pose each.
// Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, also where `distance` is negative or a pose is no rotation;
// SW_ERROR_UNSUPPORTED by a library without SW_FEATURE_CONTACT, SW_ERROR_BUSY.
SwStatus sw_model_patches_near(const struct SwModel *model,
                               const struct SwCollider *const *colliders,
                               const double *poses,
                               uint32_t n_colliders,
                               double distance,
                               uint32_t *vertices,
                               uint32_t capacity,
                               uint32_t *count);

// Positions for the eye (n_vertices x 3): as sw_state_positions, but what is inside a collider is
// pushed out of it, and its neighbours follow smoothly. Cosmetic: the motion does not know, and
// forces and contacts are those of sw_state_positions. Vertices that a support holds stay.
// *deepest, which may be NULL, is how deep a vertex still is: 0 but between colliders that leave no
// room. Allocates. Callable concurrently.
// Errors: as sw_state_positions; SW_ERROR_OUT_OF_MEMORY.
SwStatus sw_state_positions_outside(const struct SwState *state,
                                    uint32_t space,
                                    uint32_t format,
                                    void *out,
                                    uint64_t stride,
                                    uint32_t n_vertices,
                                    double *deepest);

// Where the shell touched at the end of the last step or equilibrium. `element_size` is
// sizeof(SwContact). Two calls: with `contacts` NULL and `capacity` 0 only *count is written.
// Callable concurrently.
// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, SW_ERROR_BUFFER_SIZE when capacity <
// *count, SW_ERROR_BUSY.
SwStatus sw_state_contacts(const struct SwState *state,
                           struct SwContact *contacts,
                           uint32_t element_size,
                           uint32_t capacity,
                           uint32_t *count);

/* Forces, wind and equilibrium ----------------------------------------------------------------- */

// The forces act in the next step, or the next sw_state_equilibrium, and are then forgotten.
#define SW_FORCES_ONE_STEP 1

// Forces on vertices, world axes. Copied during the call.
typedef struct SwForceDesc {
  // Set by sw_force_desc_init.
  uint32_t struct_size;
  // SW_FORCES_... or 0: the forces stay until replaced.
  uint32_t flags;
  // SW_FORMAT_... of forces. Required unless count is 0.
  uint32_t format;
  // Number of forces: 0 removes all; with vertices NULL it must be the number of vertices.
  uint32_t count;
  // Forces (count x 3).
  const void *forces;
  // Bytes from one force to the next, 0 = packed.
  uint64_t stride;
  // The vertex of each force (count), or NULL: one for every vertex in order. A vertex may come
  // more than once.
  const uint32_t *vertices;
} SwForceDesc;

// Air that drags at the shell's triangles as they are turned and move: on each of area A, with the
// air's velocity relative to it split into the part n along its normal and the rest t, 1/2 density
// A (normal_drag |n| n + tangential_drag |t| t).
typedef struct SwWindDesc {
  // Set by sw_wind_desc_init.
  uint32_t struct_size;
  // SW_FORMAT_... of local_velocities, when given.
  uint32_t local_format;
  // Of the air everywhere, world axes.
  double velocity[3];
  // Mass per volume, not negative; 0 = no wind. Air: 1.2 kg/m^3.
  double density;
  // Drag coefficient against the face, not negative; about 1 to 2.
  double normal_drag;
  // Drag coefficient along the face, not negative; about 0.01 to 0.1.
  double tangential_drag;
  // Velocity of the air at each vertex beside the one everywhere (n_vertices x 3, world axes), or
  // NULL. Copied.
  const void *local_velocities;
  // Bytes from one to the next, 0 = packed.
  uint64_t local_stride;
} SwWindDesc;

// Replaces all forces on vertices. They keep their directions in the world, as gravity does.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
SwStatus sw_state_set_forces(struct SwState *state, const struct SwForceDesc *desc);

// Replaces the wind. It presses in a step as at its start, on SW_METHOD_SHELL_IMPLICIT as at its
// end, to first order.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_UNSUPPORTED by a library
// without SW_FEATURE_WIND, SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
SwStatus sw_state_set_wind(struct SwState *state,
                           const struct SwWindDesc *desc);

// How a static solution was found. The caller sets struct_size with sw_equilibrium_report_init.
typedef struct SwEquilibriumReport {
  // Set by sw_equilibrium_report_init.
  uint32_t struct_size;
  // Fixed-point or Newton iterations.
  uint32_t iterations;
  // |q - f(q)/lambda| / |q| of a modal method, |F - dE/dx| / |F| of a nonlinear shell, of the
  // reduced one in its fields. Of nonlinear shells without load it is relative to the start's, or
  // to the shell's own stiffness. Under a small load it may be as large as the load: rounding of
  // the coordinates, where that moves the shell by less than a thousandth of its displacement.
  double residual;
  // That it took; 0 where there is no clock, as in a WebAssembly module.
  double seconds;
} SwEquilibriumReport;

// Moves the state to the static solution of its method under the present loads and constraints, at
// rest in the frame as it moves: at the pose set last, with the rates that sw_state_set_frame
// gives, none after a teleport, else the velocity and the spin of the last step, steady in the
// frame's own axes. So the shell feels the centrifugal force of a frame that turns, and the frame
// moves on without a jolt; time does not pass. The search starts from the present shape. Where that
// is of modes or fields, after sw_state_set_method, a nonlinear shell seeks the equilibrium beside
// it, and where there is none takes the way from rest. `report` may be NULL. Blocks; on failure
// nothing has moved, as where the spin is faster than the shell can bear.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_NUMERICAL when none is found,
// SW_ERROR_BUSY.
SwStatus sw_state_equilibrium(struct SwState *state,
                              struct SwEquilibriumReport *report);

// Hears of a search after each iteration what it leaves of the force, relative, on the thread that
// called it. Where the search goes on from another start, or another one follows, it rises again.
// Must return SW_PROGRESS_CONTINUE or SW_PROGRESS_CANCEL, as SwProgressFn, and must not destroy the
// state. Calls for the state from there may get SW_ERROR_BUSY.
typedef uint32_t (*SwWatchFn)(void *user, double residual);

// As sw_state_equilibrium, with a callback that hears how the search goes and may cancel: then
// nothing has moved. It hears of each iteration of nonlinear shells and of modal methods, and of
// each share of the load of reduced ones: dozens of their iterations. `watch` may be NULL.
// Errors: as of sw_state_equilibrium, SW_ERROR_CANCELLED, SW_ERROR_INVALID_ARGUMENT for an answer
// that is neither.
SwStatus sw_state_equilibrium_watched(struct SwState *state,
                                      struct SwEquilibriumReport *report,
                                      SwWatchFn watch,
                                      void *user);

/* What a step consists of ---------------------------------------------------------------------- */

// Rest positions, masses, triangles, edges, constants of each mode.
#define SW_PART_SHAPE 1
// Mode shapes Phi.
#define SW_PART_DISPLACEMENTS 2
// Modal rotations Psi.
#define SW_PART_ROTATIONS 3
// The oscillator of each mode with its guard, and the state.
#define SW_PART_MODES 4
// Gravity and the acceleration of the frame.
#define SW_PART_UNIFORM_LOAD 5
// Inertia of a turning frame.
#define SW_PART_SPIN 6
// Forces on vertices.
#define SW_PART_FORCES 7
// Wind.
#define SW_PART_WIND 8
// Constraints.
#define SW_PART_CONSTRAINTS 9
// The nonlinear shell.
#define SW_PART_NONLINEAR_SHELL 10
// The reduced nonlinear shell.
#define SW_PART_REDUCED_SHELL 11
// Contact with colliders.
#define SW_PART_CONTACT 12

// Length of SwPlanPart::reason, the closing NUL included; for good.
#define SW_PLAN_REASON_SIZE 120

// One part of a step. Output only.
typedef struct SwPlanPart {
  // SW_PART_....
  uint32_t part;
  // 1 when the step or the output uses it, else 0.
  uint32_t active;
  // Bytes held for it by the model or the state, whether used or not.
  uint64_t bytes;
  // Estimate of the instructions of the step, on registers of 8 numbers of 32 bits (AVX2); 0 when
  // left out. Mostly within a quarter (docs/evidence/leave_out.md); for an implicit step of a
  // nonlinear shell, reduced or not, by the iterations of the last step.
  double operations;
  // Why it is used, or was left out; NUL-terminated.
  char reason[SW_PLAN_REASON_SIZE];
} SwPlanPart;

// What a step of `seconds` from the present state uses, what it leaves out and why, and what each
// part costs: one entry for each SW_PART_..., in ascending order. `element_size` is
// sizeof(SwPlanPart). Two calls: with `parts` NULL and `capacity` 0 only *count is written.
// Callable concurrently.
// Errors: SW_ERROR_INVALID_DESC, SW_ERROR_INVALID_ARGUMENT, also as by sw_state_step;
// SW_ERROR_BUFFER_SIZE when capacity < *count; SW_ERROR_BUSY.
SwStatus sw_state_plan(const struct SwState *state,
                       double seconds,
                       struct SwPlanPart *parts,
                       uint32_t element_size,
                       uint32_t capacity,
                       uint32_t *count);

// The same as a table in words, UTF-8 and NUL-terminated. Two calls: with `text` NULL and
// `capacity` 0 only *size is written, the NUL included. Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, also as by sw_state_step; SW_ERROR_BUFFER_SIZE when capacity <
// *size; SW_ERROR_BUSY.
SwStatus sw_state_plan_text(const struct SwState *state,
                            double seconds,
                            char *text,
                            uint64_t capacity,
                            uint64_t *size);

/* What a state gets wrong, and another method for it ------------------------------------------- */

// For sw_state_correct: on to the full shell's equilibrium, where fields are more than 5 % off it.
// For what shows corrected positions: those that sw_state_correct kept since the last step.
#define SW_STEPS_AUTO 4294967295

// How far a state is from the full nonlinear shell, by an estimate. The caller sets struct_size
// with sw_certificate_init.
typedef struct SwCertificate {
  // Set by sw_certificate_init.
  uint32_t struct_size;
  // 1 when error is above 0.2: the pose is outside what the method, or the fields of a reduced
  // shell, were made for.
  uint32_t out_of_range;
  // Estimated error of the displacement relative to it, both as mass-weighted L2 norms;
  // displacements count from the shape of no energy, also with sag_gravity.
  double error;
  // Estimated error of the vertex that has the largest, length.
  double max_error;
  // That vertex.
  uint32_t vertex;
  // The SW_METHOD_... that it is of.
  uint32_t method;
  // What the full shell's forces leave of the load's at this pose, relative to the load, inertia
  // and constraints' forces included: no measure of the error, since stretching that nobody sees
  // leaves hundreds of times the load.
  double residual;
  // The same at the better pose that the estimate compares with, or the share by which a hard
  // constraint or wind was not followed there. Above 0.01 the search for it was cut short, and the
  // estimate is rough.
  double remaining;
  // Factorizations of the full shell's stiffness that it took.
  uint32_t factorizations;
  // 0.
  uint32_t reserved;
  // Bytes of the full shell's matrix, factor and fields, which the model keeps for the next call.
  uint64_t bytes;
  // As error, of the positions that sw_state_correct kept since the last step: a second estimate,
  // from there. The same as error where nothing is kept, and from sw_state_fall_back.
  double corrected_error;
  // As max_error, of these.
  double corrected_max_error;
  // That it took; 0 where there is no clock, as in a WebAssembly module.
  double seconds;
} SwCertificate;

// Estimates what a state gets wrong against the full nonlinear shell, under the loads, constraints
// and frame as they are now, by a few Newton steps of the full shell from the present pose. At rest
// that is the error of the equilibrium; where the full shell has several, as one that buckles, it
// is the distance to the one that these steps lead to, and another may be far. That one is stable:
// a column that a method keeps upright counts as far off as it would fall. In motion the inertia
// and damping that the method has are taken for right: it is what its forces get wrong at this
// moment, not what has added up. Rigid motions that supports and constraints leave free do not
// count. What a hard constraint misses of its target counts, also before a step. Wind follows the
// shell. A state of a nonlinear shell gets zeros.
//
// Takes as long as one to three steps of SW_METHOD_SHELL_IMPLICIT. Of a pose that is far off it
// takes longer: up to sixty iterations of a factorization each, of a few where the shell is about
// to snap; with wind, free motions, missed constraints and balances that prove unstable some times
// that. The first time it takes the analysis of the stiffness, too, which the model keeps. To be
// called now and then, not in every step. `certificate` must be initialised by sw_certificate_init.
// Callable concurrently.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_INVALID_DESC, SW_ERROR_UNSUPPORTED by a library
// without the feature nonlinear-shell, SW_ERROR_NUMERICAL when the full shell has no stiffness to
// go by, as where k_bend is 0 and parts turn freely against each other; SW_ERROR_OUT_OF_MEMORY,
// SW_ERROR_BUSY.
SwStatus sw_state_certify(const struct SwState *state,
                          struct SwCertificate *certificate);

// As sw_state_certify, with a callback that hears of each iteration and may cancel: between two
// calls there is one factorization, or a few where the shell is about to snap. `watch` may be NULL.
// Errors: as of sw_state_certify, SW_ERROR_CANCELLED, SW_ERROR_INVALID_ARGUMENT for an answer that
// is neither.
SwStatus sw_state_certify_watched(const struct SwState *state,
                                  struct SwCertificate *certificate,
                                  SwWatchFn watch,
                                  void *user);

// Takes `steps` Newton steps of the full nonlinear shell, and keeps where they lead. They go toward
// its balance under the loads that are set now and the inertia that the method has. A dial between
// the method and SW_METHOD_SHELL_IMPLICIT, for output alone: the motion does not know. Call it once
// a frame, after its steps; sw_state_positions_corrected and bound points with correction_steps
// show what is kept until the next step. It goes on from where the last call led, moved along with
// the method's pose, or from that pose where this leaves far less of the force. So one step a frame
// is enough also where the shell buckles, once it has caught up. A copy of the state has its own,
// and sw_state_save saves it: 8 bytes for each of 3 numbers a vertex and one an element of the
// energy. sw_state_reset, a change by sw_state_set_method and whatever puts the shell elsewhere
// forget it. steps is 0 to 100; 0 forgets it. A nonlinear shell needs none. SW_STEPS_AUTO goes on
// to the full shell's equilibrium, as sw_state_certify seeks it, where that finds more than 5 % of
// the displacement wrong. Where it finds no equilibrium it takes the full shell's way from rest. So
// it does first where more than half is wrong and nothing is kept of an earlier frame. That way is
// for shells of up to 2,500 vertices that supports or handles hold and that touch nothing.
// SW_STEPS_AUTO is for states at rest that move by fields: no velocities, and forces that balance
// the loads to a thousandth, as after sw_state_equilibrium; without SW_STATE_DETERMINISTIC; whose
// rest shape does not move. Of any other, and where it finds none, it keeps nothing and succeeds.
// In motion it does nothing: near a fold the inertia of a method that is far off leads astray. Each
// takes a factorization of the full shell's stiffness, and the first call its analysis, which the
// model keeps. Allocates.
// Errors: as sw_state_certify; what was kept before stays.
SwStatus sw_state_correct(struct SwState *state,
                          uint32_t steps);

// As sw_state_correct, with a callback that hears of each step, and of each iteration of
// SW_STEPS_AUTO, and may cancel. Then what was kept before stays. `watch` may be NULL.
// Errors: as of sw_state_correct, SW_ERROR_CANCELLED, SW_ERROR_INVALID_ARGUMENT for an answer that
// is neither.
SwStatus sw_state_correct_watched(struct SwState *state,
                                  uint32_t steps,
                                  SwWatchFn watch,
                                  void *user);

// Positions (n_vertices x 3) where sw_state_correct led since the last step. Without that, they are
// where `steps` Newton steps of the full nonlinear shell lead from the state's pose, or from what
// an earlier frame kept. Loads are those that are set now, and the inertia is the method's. For
// output alone: the motion does not know, and no step costs more. From a reduced shell that is a
// few percent off, one step leaves about a fifth of the error and two less than a hundredth; from
// one that is far off, as where the shell buckles, they help less. sw_state_certify tells the error
// of the method's own pose. steps is 0 to 100; 0 gives sw_state_positions, as does a nonlinear
// shell. SW_STEPS_AUTO shows what is kept, and takes no step: sw_state_positions where nothing is.
// Each takes a factorization of the full shell's stiffness, and the first call its analysis, which
// the model keeps. Vertices that hard constraints hold stay. Allocates. Callable concurrently.
// Errors: as sw_state_positions, and as sw_state_certify.
SwStatus sw_state_positions_corrected(const struct SwState *state,
                                      uint32_t steps,
                                      uint32_t space,
                                      uint32_t format,
                                      void *out,
                                      uint64_t stride,
                                      uint32_t n_vertices);

// Goes on by SW_METHOD_WARP, the paper's method, where that is nearer to the full nonlinear shell.
// It is so where its estimate by sw_state_certify, or what its hard handles miss of their way, is
// less than the state's own. It is also where the state misses more than half of a hard handle's
// way and the warp less. A state without velocities, as after sw_state_equilibrium, found or not,
// is set against a warp at rest under the same loads. That is sought from its rest shape, or from
// the state's pose where solids or nothing hold it. A state that moves is set against the warp at
// the nearest pose, as by sw_state_set_method. `certificate`, initialised by sw_certificate_init,
// is of the method that goes on, which it names. SW_METHOD_WARP and the nonlinear shells are only
// certified.
//
// Takes as long as two of sw_state_certify. The two estimates of a state without velocities may
// lead to different equilibria, as of a shell that buckles or snaps through. Where a hard handle
// leads it, both are set against that of the state's own, which depends on the way that it took. In
// two cases both are set against the equilibrium of the full shell from rest, and the certificate
// is of it. The first: the state's own estimate finds half of its displacement wrong, and the warp
// comes to the handle. The second: no hard handle leads it, and the estimates do not decide or one
// is wanting. Then it takes as long as sw_state_equilibrium of SW_METHOD_SHELL_IMPLICIT besides.
// Call it when a handle is let go or a pose is found, not in every step. States saved before belong
// to the method that they were saved with. Allocates; on failure nothing has changed.
// Errors: as of sw_state_certify, SW_ERROR_NUMERICAL where neither method has an estimate.
SwStatus sw_state_fall_back(struct SwState *state,
                            struct SwCertificate *certificate);

// As sw_state_fall_back, with a callback that hears of each iteration of all that it seeks, and may
// cancel: then nothing has changed. `watch` may be NULL.
// Errors: as of sw_state_fall_back, SW_ERROR_CANCELLED, SW_ERROR_INVALID_ARGUMENT for an answer
// that is neither.
SwStatus sw_state_fall_back_watched(struct SwState *state,
                                    struct SwCertificate *certificate,
                                    SwWatchFn watch,
                                    void *user);

// Goes on by another SW_METHOD_..., from the pose and velocities nearest to the present ones in the
// mass norm, with the same time, frame, loads, damping, constraints and integrator: when
// sw_state_certify or unconverged_steps tell that a reduced shell has left its range,
// SW_METHOD_WARP_VIRTUAL_WORK or SW_METHOD_WARP goes on, and back again. To
// SW_METHOD_SHELL_IMPLICIT nothing is lost; to fields or modes, what these do not span, so vertices
// jump by that much. 0 is the default method of the model. States saved before belong to the method
// that they were saved with. Allocates; on failure nothing has changed.
// Errors: SW_ERROR_INVALID_ARGUMENT, SW_ERROR_UNSUPPORTED where the method cannot take a constraint
// or damping ratios that differ from each other, or as by sw_state_create; SW_ERROR_NUMERICAL,
// SW_ERROR_OUT_OF_MEMORY, SW_ERROR_BUSY.
SwStatus sw_state_set_method(struct SwState *state,
                             uint32_t method);

/* Structs at their defaults -------------------------------------------------------------------- */

// Each writes zeros, and the size that this header gives the struct. NULL does nothing. A parser
// that reads declarations alone leaves them out by defining SHELLWARP_NO_INLINE, and calls
// sw_struct_init.
#ifndef SHELLWARP_NO_INLINE
static inline void sw_mesh_desc_init(SwMeshDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_material_map_init(SwMaterialMap *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_material_desc_init(SwMaterialDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_support_desc_init(SwSupportDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_precompute_desc_init(SwPrecomputeDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_model_info_init(SwModelInfo *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_state_desc_init(SwStateDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_damping_desc_init(SwDampingDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_frame_desc_init(SwFrameDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_state_report_init(SwStateReport *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_binding_desc_init(SwBindingDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_binding_info_init(SwBindingInfo *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_bound_points_desc_init(SwBoundPointsDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_proxy_desc_init(SwProxyDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_proxy_info_init(SwProxyInfo *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_calibration_desc_init(SwCalibrationDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_calibration_info_init(SwCalibrationInfo *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_constraint_desc_init(SwConstraintDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_collider_desc_init(SwColliderDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_collider_pose_desc_init(SwColliderPoseDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_capsule_fit_init(SwCapsuleFit *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_force_desc_init(SwForceDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_wind_desc_init(SwWindDesc *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_equilibrium_report_init(SwEquilibriumReport *s) {
  sw_struct_init(s, sizeof *s);
}
static inline void sw_certificate_init(SwCertificate *s) {
  sw_struct_init(s, sizeof *s);
}
#endif

#ifdef __cplusplus
}
#endif

#endif
