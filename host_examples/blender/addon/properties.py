"""What a user sets on an object; saved in the file, undone with it, keyable where it says so. docs/guide/blender.md has the table."""

import bpy
from bpy.props import (BoolProperty, CollectionProperty, EnumProperty, FloatProperty, FloatVectorProperty, IntProperty,
                       PointerProperty, StringProperty)

from . import library

OVER = {"LIBRARY_OVERRIDABLE"}  # all may be changed in overrides of linked objects
LISTS = OVER | {"USE_INSERTION"}
NOT_KEYED = set()  # changes make a new model or a new run: no keyframes


def changed(settings, _context):
    """Has Blender copy the value to the evaluated object, where inputs.py reads it with its animation."""
    settings.id_data.update_tag()


_methods = []  # Blender keeps no reference to the strings of a menu that is made when it is shown


def methods(_settings, _context):
    """The library's table as a menu, empty while there is no library, which the panel tells. A file keeps the numbers, SW_METHOD_...,
    and these are for good; so files survive a table that grows."""
    if not _methods:
        try:
            table = library.package().method.table()
        except (ImportError, OSError):
            return []
        _methods.extend((method.name, method.label, described(method), method.number) for method in table)
    return _methods


def preset_names(_settings, _context, text):
    """Names of known materials with this text in them, for the search."""
    try:
        known = library.package().presets()
    except (ImportError, OSError):
        return []
    return [name for name, (label, _) in known.items() if text.lower() in f"{name} {label}".lower()]


def described(method):
    """What a user should know of a method's price before choosing it."""
    if method.needs_fields:
        return "Trained at the precompute, which takes longer; wants vertices that are held"
    if method.needs_choice:
        return "A reduced shell where the shell can have one, trained for up to half a minute, else the warp. With an error, what is within it"
    if method.is_full_shell:
        return "The full nonlinear shell: slow on large meshes"
    return "By modes"


def is_empty(_self, obj):
    return obj.type == "EMPTY"


class ShellwarpHandle(bpy.types.PropertyGroup):
    """One vertex led by an empty."""

    target: PointerProperty(override=OVER, update=changed, name="Empty", type=bpy.types.Object, poll=is_empty,
                            description="Its place and axes in the world are where the vertex is led")
    vertex: IntProperty(override=OVER, update=changed, name="Vertex", min=0, options=NOT_KEYED)
    kind: EnumProperty(override=OVER, update=changed, name="Holds", default="POSITION", options=NOT_KEYED, items=[
        ("POSITION", "Position", "The vertex goes to the empty"),
        ("ORIENTATION", "Orientation", "The vertex's frame takes the empty's axes"),
        ("BOTH", "Both", "Position and orientation")])
    axes: bpy.props.BoolVectorProperty(override=OVER, update=changed, name="Axes", subtype="XYZ", default=(True, True, True),
                                       description="World axes along and about which it holds")
    compliance: FloatProperty(override=OVER, update=changed, name="Compliance", min=0, precision=5,
                              description="Gives way by this much per force; 0 is hard")
    held: BoolProperty(override=OVER, update=changed, name="Held", default=True, description="Key this off to let go")


def is_mesh(settings, obj):
    return obj.type == "MESH" and obj != settings.id_data


class ShellwarpRender(bpy.types.PropertyGroup):
    """A mesh that follows the shell."""

    target: PointerProperty(override=OVER, name="Render mesh", type=bpy.types.Object, poll=is_mesh, options=NOT_KEYED,
                            description="Its vertices follow the shell, which is a proxy for it. Any faces, any modifiers")


class ShellwarpCollider(bpy.types.PropertyGroup):
    """What shells touch of an object."""

    enabled: BoolProperty(override=OVER, name="Shellwarp Collider", options=NOT_KEYED, description="Shells touch this object")
    shape: EnumProperty(override=OVER, name="Shape", default="AUTO", options=NOT_KEYED, items=[
        ("AUTO", "By its mesh", "The mesh, deforming where an armature, hook or keyed shape keys deform it; a plane where it is flat across its z axis, or "
         "where there is none"),
        ("PLANE", "Plane", "All below the object's z axis, however large its mesh"),
        ("SPHERE", "Sphere", "As wide as the mesh's longest side"),
        ("BOX", "Box", "The mesh's bounding box"),
        ("CAPSULE", "Capsule", "Along the object's z axis, as long and as wide as the mesh"),
        ("HULL", "Convex hull", "Of the mesh's vertices"),
        ("MESH", "Mesh", "The inside of the mesh, as distances on a grid. An open mesh is solid behind its faces"),
        ("DEFORMING", "Deforming mesh", "The inside of a mesh whose vertices move by its modifiers and shape keys, an open one behind its faces. Its faces stay")])
    cells: IntProperty(override=OVER, name="Cells", default=64, min=4, max=2000, options=NOT_KEYED,
                       description="Of a mesh: cells of its grid along the longest side")
    friction: FloatProperty(override=OVER, name="Friction", default=0.3, min=0, soft_max=1, options=NOT_KEYED, description="Coulomb's coefficient")
    thickness: FloatProperty(override=OVER, name="Thickness", default=0.0, min=0, subtype="DISTANCE", options=NOT_KEYED,
                             description="How far shells stay off the surface")
    depth: FloatProperty(override=OVER, name="Depth", default=0.0, min=0, subtype="DISTANCE", options=NOT_KEYED,
                         description="Of an open mesh: how far it is solid behind its faces, on the side that their normals turn away from. 0: four cells, of a "
                                     "deforming mesh a 16th of its longest side")


class ShellwarpSettings(bpy.types.PropertyGroup):
    """A shell's settings, on its object."""

    enabled: BoolProperty(override=OVER, name="Shellwarp", options=NOT_KEYED, description="This mesh is a shell")
    live: BoolProperty(override=OVER, name="Live", default=True, options=NOT_KEYED,
                       description="Move on frame changes, into the shape key “shellwarp”. Off: the mesh is left alone")

    # How it was made of the first mesh that follows, where it was: 0 of one by hand.
    proxy_vertices: IntProperty(override=OVER, min=0, options=NOT_KEYED)
    proxy_thickness: FloatProperty(override=OVER, min=0, options=NOT_KEYED)
    proxy_cut: BoolProperty(override=OVER, options=NOT_KEYED)
    proxy_held: bpy.props.StringProperty(override=OVER, options=NOT_KEYED)   # groups, by lines
    proxy_calibrated: BoolProperty(override=OVER, name="As stiff as the render mesh", default=True, options=NOT_KEYED,
                                   description="Fit the proxy's stiffness so that it hangs as the first mesh that follows would")

    material: EnumProperty(override=OVER, name="Material", default="CONSTANTS", options=NOT_KEYED, items=[
        ("CONSTANTS", "Constants", "The paper's four numbers, which are the mesh's and the unit's"),
        ("PRESET", "Known material", "A sheet by name: docs/reference/materials.md"),
        ("SHEET", "Sheet", "Young's modulus, Poisson's ratio, thickness and density in SI units"),
        ("FREQUENCY", "Frequency", "By look: how fast the slowest swing is"),
        ("SAG", "Sag", "By look: how far it hangs at rest under gravity")])
    frequency: FloatProperty(override=OVER, name="Frequency, Hz", default=2.0, min=1e-3, soft_max=30, options=NOT_KEYED,
                             description="Of the slowest swing: a leaf 2 to 5, sheet metal 20 and more. Twice as fast sags a quarter as far")
    sag: FloatProperty(override=OVER, name="Sag", default=0.1, min=1e-6, subtype="DISTANCE", precision=4, options=NOT_KEYED,
                       description="How far the vertex that moves furthest hangs at rest under the scene's gravity, where the shell stands at the start frame")
    preset: StringProperty(override=OVER, name="Known material", default="card", options=NOT_KEYED, search=preset_names,
                           description="A name of the library's table")
    young: FloatProperty(override=OVER, name="Young's modulus, Pa", default=3e9, min=0, options=NOT_KEYED)
    poisson: FloatProperty(override=OVER, name="Poisson's ratio", default=0.3, min=-0.99, max=0.5, options=NOT_KEYED)
    thickness: FloatProperty(override=OVER, name="Thickness, m", default=0.0, min=0, precision=6, step=0.01, options=NOT_KEYED,
                             description="Of a known material 0 is its own, by frequency and sag a two-hundredth of the size")
    volume_density: FloatProperty(override=OVER, name="Density, kg/m³", default=1000, min=0, options=NOT_KEYED)
    young_across: FloatProperty(override=OVER, name="Modulus across, Pa", default=0.0, min=0, options=NOT_KEYED,
                                description="Young's modulus across a direction, where the sheet has a grain. 0: the same in all directions")
    shear: FloatProperty(override=OVER, name="Shear modulus, Pa", default=0.0, min=0, options=NOT_KEYED,
                         description="Between the two directions. 0: Huber's estimate")
    direction: FloatVectorProperty(override=OVER, name="Direction", default=(1, 0, 0), subtype="XYZ", options=NOT_KEYED,
                                   description="Of Young's modulus, in the object's axes, projected into each face")
    directions: StringProperty(override=OVER, name="Direction by UV map", options=NOT_KEYED,
                               description="UV map whose u grows in the direction of Young's modulus. Empty: the direction below")
    thickness_group: StringProperty(override=OVER, name="Thickness map", options=NOT_KEYED,
                                    description="Vertex group whose weights multiply the thickness. Vertices outside keep it")
    young_group: StringProperty(override=OVER, name="Stiffness map", options=NOT_KEYED,
                                description="Vertex group whose weights multiply Young's modulus. Vertices outside keep it")
    density_group: StringProperty(override=OVER, name="Density map", options=NOT_KEYED,
                                  description="Vertex group whose weights multiply the density. Vertices outside keep it")
    bend_group: StringProperty(override=OVER, name="Bending map", options=NOT_KEYED,
                               description="Vertex group whose weights multiply the bending constant. Vertices outside keep it")
    stretch_group: StringProperty(override=OVER, name="Stretch map", options=NOT_KEYED,
                                  description="Vertex group whose weights multiply the constants of stretch and area. Vertices outside keep them")

    density: FloatProperty(override=OVER, name="Density", default=1.0, min=1e-9, soft_max=1000, precision=4, options=NOT_KEYED,
                                description="Mass per area")
    k_bend: FloatProperty(override=OVER, name="Bending", default=1.0, min=0, precision=5, options=NOT_KEYED,
                          description="k_B, energy. The plate rigidity is six times this")
    k_length: FloatProperty(override=OVER, name="Stretch", default=1e4, min=0, options=NOT_KEYED, description="k_L, energy per length")
    k_area: FloatProperty(override=OVER, name="Area", default=1e4, min=0, options=NOT_KEYED, description="k_A, energy per area")
    growth: FloatProperty(override=OVER, name="Growth", default=0.0, soft_min=-0.5, soft_max=1, min=-0.99, precision=3, options=NOT_KEYED,
                          description="By how much of themselves lengths without stress are longer, at a weight of 1: 0.2 makes a rim ruffle")
    growth_group: StringProperty(override=OVER, name="Growth map", options=NOT_KEYED,
                                 description="Vertex group whose weights multiply the growth. Vertices outside do not grow. Empty: all grow alike")
    rest_shape: StringProperty(override=OVER, name="Rest shape", options=NOT_KEYED,
                               description="Shape key that is the shape without stress: the shell first comes to rest from the basis. Empty: the basis")
    crease_factors: StringProperty(override=OVER, name="Creases", options=NOT_KEYED,
                                   description="Edge attribute whose numbers multiply the stiffness against bending there; 0 turns freely")
    crease_angles: StringProperty(override=OVER, name="Rest angles", options=NOT_KEYED,
                                  description="Edge attribute of the angles at which edges rest, rad, convex on the faces' outside; 0: as the basis has it")
    crease_flat: StringProperty(override=OVER, name="Flat edges", options=NOT_KEYED,
                                description="Boolean edge attribute of the edges that rest flat, although the basis is folded there. It goes over the rest angles")
    crease_yields: StringProperty(override=OVER, name="Yield angles", options=NOT_KEYED,
                                  description="Edge attribute of how far edges spring back, rad: what they are folded beyond stays. 0: all springs back. "
                                              "By the reduced shell and the full shell")
    stiffness_factor: FloatProperty(override=OVER, update=changed, name="Stiffness factor", default=1.0, min=1e-9, max=1e9, soft_min=0.01, soft_max=100,
                                    description="Multiplies all stiffness while it runs, without another model: a leaf that wilts")
    fixed_group: StringProperty(override=OVER, name="Fixed", options=NOT_KEYED,
                                description="Vertex group held in place by the object: weights above a half")
    clamped_group: StringProperty(override=OVER, name="Clamped", options=NOT_KEYED,
                                  description="Held together with the neighbouring vertices, so the slope as well")
    fixed_x_group: StringProperty(override=OVER, name="Held along x", options=NOT_KEYED,
                                  description="Vertex group held along the object's x axis alone, as on a symmetry plane or a rail")
    fixed_y_group: StringProperty(override=OVER, name="Held along y", options=NOT_KEYED, description="Vertex group held along the object's y axis alone")
    fixed_z_group: StringProperty(override=OVER, name="Held along z", options=NOT_KEYED, description="Vertex group held along the object's z axis alone")
    symmetric_axes: bpy.props.BoolVectorProperty(override=OVER, name="Planes of symmetry", subtype="XYZ", options=NOT_KEYED,
                                                 description="The groups held along these axes are on planes of symmetry: the slope is held too")
    tie_edges: BoolProperty(override=OVER, name="Loose edges tie", options=NOT_KEYED,
                            description="Edges without faces hold their ends where they are beside each other: seams, straps, buttons")
    tie_stiffness: FloatProperty(override=OVER, name="Stiffness of ties", default=0.0, min=0, options=NOT_KEYED,
                                 description="Force per length by which loose edges hold their ends; 0: stiff")
    tie_within: FloatProperty(override=OVER, name="Tie within", default=0.0, min=0, subtype="DISTANCE", options=NOT_KEYED,
                              description="Of two pieces of the mesh this near, the vertices of one are tied to the nearest faces of the other, stiffly. 0: none")
    follow: BoolProperty(override=OVER, name="Pins follow", default=True, options=NOT_KEYED,
                         description="Shape keys, and modifiers such as Armature and Hook before the shell's own, lead what is held. Off: "
                         "the object does, and they come after the shell")
    follow_rest: BoolProperty(override=OVER, name="Rest shape follows", options=NOT_KEYED,
                              description="What leads the pins leads the whole rest shape, as blend shapes and skinned cloth: the shell swings about it. "
                              "Colliders and handles act on what is shown. Without the full shell")
    support_fields: IntProperty(override=OVER, name="Support fields", default=24, min=1, soft_max=64, options=NOT_KEYED,
                                description="Shapes beside the modes by which the shell follows pins that go apart")
    modes: IntProperty(override=OVER, name="Modes", default=16, min=1, max=1024, options=NOT_KEYED)
    method: EnumProperty(override=OVER, name="Method", default=7, options=NOT_KEYED, items=methods,  # 7: SW_METHOD_AUTO
                         description="How the shell moves. The library's own table: docs/guide/methods.md")
    reduced_fields: IntProperty(override=OVER, name="Reduced fields", default=40, min=1, soft_max=100, options=NOT_KEYED,
                                description="Shapes beside the modes, of methods that need them. Modes and fields are at most 128 together")
    auto_error: FloatProperty(override=OVER, name="Automatic error", min=0, subtype="DISTANCE", options=NOT_KEYED,
                              description="Of the automatic choice: the methods are tried under the scene's gravity, and the cheapest with no larger error is "
                              "taken. 0: a reduced shell where there can be one, without trials")
    correction_steps: IntProperty(override=OVER, name="Correction steps", min=0, max=100, options=NOT_KEYED,
                                  description="Newton steps of the full shell in each frame, on from those of the frame before: nearer to it, and a factorization each. "
                                  "The motion does not know of them")
    integrator: EnumProperty(override=OVER, name="Integrator", default="implicit-euler", options=NOT_KEYED, items=[
        ("implicit-euler", "Backward Euler", "Calms what a step does not resolve"),
        ("exact", "Exact", "No numerical damping: rings until the damping below stops it"),
        ("second-order", "Second order", "Of the full shell: two to three times the time of a step, and little numerical damping. Of modes the exact one")])

    precision: EnumProperty(override=OVER, name="Precision", default="f32", options=NOT_KEYED, items=[
        ("f32", "32 bits", "Numbers of the shapes that steps read; modes are found in 64 bits anyway"),
        ("f64", "64 bits", "Twice the memory, and as exact as the arithmetic is")])

    gravity: FloatProperty(override=OVER, update=changed, name="Gravity", default=1.0, description="Factor on the scene's gravity")
    damping_ratio: FloatProperty(override=OVER, update=changed, name="Damping", default=0.05, min=0, soft_max=1,
                                 description="Fraction of critical damping")
    damping_mass: FloatProperty(override=OVER, update=changed, name="Mass damping", min=0,
                                description="Rayleigh's coefficient of the masses, 1/s")
    damping_stiffness: FloatProperty(override=OVER, update=changed, name="Stiffness damping", min=0, precision=5,
                                     description="Rayleigh's coefficient of the stiffness, s")
    damping_group: StringProperty(override=OVER, name="Damping map", options=NOT_KEYED,
                                  description="Vertex group whose weights multiply damping and mass damping. Vertices outside keep it")
    fields: FloatProperty(override=OVER, update=changed, name="Force fields", default=1.0, description="Factor on the scene's wind, force and vortex fields")
    force: FloatVectorProperty(override=OVER, update=changed, name="Force", subtype="XYZ",
                               description="At each vertex where the force's group has a weight of 1, world axes; of sheets in newtons")
    force_group: StringProperty(override=OVER, name="Force on", options=NOT_KEYED,
                                description="Vertex group whose weights are how much of the force acts; nothing outside")
    wind: FloatVectorProperty(override=OVER, update=changed, name="Wind", subtype="VELOCITY", description="Velocity of the air, world axes")
    air_density: FloatProperty(override=OVER, update=changed, name="Air density", min=0,
                               description="Mass per volume, of sheets in kg/m³: air has 1.2. 0 is no air, or 1.2 kg/m³ where a wind field blows")
    normal_drag: FloatProperty(override=OVER, update=changed, name="Drag across", min=0, default=1.5)
    tangential_drag: FloatProperty(override=OVER, update=changed, name="Drag along", min=0, default=0.05)

    frame_start: IntProperty(override=OVER, name="Start", default=1, options=NOT_KEYED, description="Here the shell is at rest")
    frame_end: IntProperty(override=OVER, name="End", default=250, options=NOT_KEYED, description="The last frame that is baked")
    steps_per_frame: IntProperty(override=OVER, update=changed, name="Steps per frame", default=1, min=1, max=1000, options=NOT_KEYED)
    cache: StringProperty(override=OVER, name="Cache", subtype="FILE_PATH", default="", options=NOT_KEYED,
                          description="Point cache (PC2); empty: cache/OBJECT.pc2 beside the blend file")

    verdict: StringProperty(override=OVER, name="Last bake", options={"HIDDEN"}, description="How good the last bake is; kept in the file")
    baked_mesh: StringProperty(override=OVER, name="Baked mesh", options={"HIDDEN"}, description="What tells the mesh of the last bake from others")

    collision_collection: PointerProperty(override=OVER, name="Collision collection", type=bpy.types.Collection, options=NOT_KEYED,
                                          description="The shell touches the colliders of this collection; empty: of the scene")
    contact_patches: StringProperty(override=OVER, name="Contact patches", options=NOT_KEYED,
                                    description="Vertex group of vertices that are touched by what is smaller than the modes: each adds a mode")
    push_out: BoolProperty(override=OVER, name="Push out", options=NOT_KEYED,
                           description="Show vertices outside colliders where the modes cannot follow. The motion does not know of it")
    renders: CollectionProperty(override=LISTS, type=ShellwarpRender)
    active_render: IntProperty(options=NOT_KEYED)
    handles: CollectionProperty(override=LISTS, type=ShellwarpHandle)
    active_handle: IntProperty(options=NOT_KEYED)


_CLASSES = (ShellwarpHandle, ShellwarpRender, ShellwarpCollider, ShellwarpSettings)


def register():
    for item in _CLASSES:
        bpy.utils.register_class(item)
    bpy.types.Object.shellwarp = PointerProperty(override=OVER, type=ShellwarpSettings)
    bpy.types.Object.shellwarp_collider = PointerProperty(override=OVER, type=ShellwarpCollider)


def unregister():
    del bpy.types.Object.shellwarp_collider
    del bpy.types.Object.shellwarp
    for item in reversed(_CLASSES):
        bpy.utils.unregister_class(item)
