"""The panel in Properties > Physics."""

import bpy

from . import bake, colliders, fields, inputs, library, live, materials, operators, presets, stack

GROUPS = [
    ("Material", ("material", "preset", "frequency", "sag", "young", "poisson", "young_across", "shear", "directions", "direction", "thickness",
                  "volume_density", "density", "k_bend", "k_length", "k_area", "thickness_group", "young_group", "density_group", "bend_group",
                  "stretch_group", "growth", "growth_group", "rest_shape", "crease_factors", "crease_angles", "crease_flat", "crease_yields", "stiffness_factor")),
    ("Method", ("method", "reduced_fields", "auto_error", "modes", "correction_steps", "integrator", "precision")),
    ("Damping", ("damping_ratio", "damping_mass", "damping_stiffness", "damping_group")),
    ("Loads", ("gravity", "fields", "force_group", "force", "wind", "air_density", "normal_drag", "tangential_drag")),
    ("Time", ("frame_start", "frame_end", "steps_per_frame")),
]


# Which materials read a setting.
MATERIALS = {**dict.fromkeys(("k_bend", "k_length", "k_area", "bend_group", "stretch_group"), ("CONSTANTS",)),
             **dict.fromkeys(("young", "poisson", "volume_density"), ("SHEET",)), "preset": ("PRESET",), "frequency": ("FREQUENCY",), "sag": ("SAG",),
             **dict.fromkeys(("thickness_group", "young_group", "young_across", "shear", "direction", "directions"), ("PRESET", "SHEET")),
             "density": ("CONSTANTS", "FREQUENCY", "SAG"), "thickness": ("PRESET", "SHEET", "FREQUENCY", "SAG")}


class SHELLWARP_UL_handles(bpy.types.UIList):
    """The handles of a shell."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property, _index):
        row = layout.row(align=True)
        row.prop(item, "target", text="")
        row.prop(item, "vertex", text="")
        row.prop(item, "held", text="")


class SHELLWARP_UL_renders(bpy.types.UIList):
    """The meshes that follow a shell."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property, _index):
        layout.prop(item, "target", text="")


class SHELLWARP_PT_shell(bpy.types.Panel):
    """A mesh as a shell."""

    bl_label = "Shellwarp"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "physics"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH"

    def draw_header(self, context):
        self.layout.prop(context.object.shellwarp, "enabled", text="")

    def draw_header_preset(self, _context):
        presets.SHELLWARP_PT_presets.draw_panel_header(self.layout)

    def draw(self, context):
        obj, layout = context.object, self.layout
        settings = obj.shellwarp
        layout.use_property_split = True
        if not settings.enabled:
            layout.operator("shellwarp.make_proxy")
        layout.active = settings.enabled
        draw_state(layout, context, obj)
        layout.prop(settings, "live")
        layout.prop_search(settings, "fixed_group", obj, "vertex_groups")
        layout.prop_search(settings, "clamped_group", obj, "vertex_groups")
        for letter in "xyz":
            layout.prop_search(settings, f"fixed_{letter}_group", obj, "vertex_groups")
        if settings.fixed_x_group or settings.fixed_y_group or settings.fixed_z_group:
            layout.row().prop(settings, "symmetric_axes", toggle=True)
        draw_ties(layout, settings)
        draw_follow(layout, obj)
        for title, names in GROUPS:
            column = layout.column(heading=title)
            for name in names:
                if not wanted(settings, name):
                    continue
                if name.endswith("_group"):
                    column.prop_search(settings, name, obj, "vertex_groups")
                elif name == "directions":
                    column.prop_search(settings, name, obj.data, "uv_layers")
                else:
                    column.prop(settings, name)
        unit = materials.metres(context.scene)
        if materials.is_real(settings) and unit != 1.0:
            layout.label(text=f"Here gravity is {settings.gravity * context.scene.gravity.length * unit:.3g} m/s²", icon="INFO")
        unfelt = fields.unfelt(obj, context.view_layer) if settings.fields else []
        if unfelt:
            layout.label(text=f"Fields that do not act on shells: {', '.join(unfelt)}", icon="INFO")
        layout.prop(settings, "collision_collection")
        row = layout.row(align=True)
        row.prop_search(settings, "contact_patches", obj, "vertex_groups")
        row.operator("shellwarp.find_patches", text="", icon="VIEWZOOM")
        layout.prop(settings, "push_out")
        draw_handles(layout, settings)
        draw_renders(layout, obj)
        layout.prop(settings, "cache")
        row = layout.row(align=True)
        row.operator("shellwarp.precompute")
        row.operator("shellwarp.certify")
        row.operator("shellwarp.bake")
        row.operator("shellwarp.free_bake")
        layout.operator("shellwarp.export")


def draw_ties(layout, settings):
    """What is held together."""
    layout.prop(settings, "tie_edges")
    if settings.tie_edges:
        layout.prop(settings, "tie_stiffness")
    layout.prop(settings, "tie_within")


def draw_follow(layout, obj):
    """What leads the pins."""
    settings = obj.shellwarp
    layout.prop(settings, "follow")
    if stack.leads(obj):
        layout.label(text=f"{'All follows' if settings.follow_rest else 'They follow'} {stack.named(obj)}", icon="INFO")
        layout.prop(settings, "follow_rest")
        if inputs.follows_by_fields(settings) and not settings.follow_rest:
            layout.prop(settings, "support_fields")
    lost = stack.out_of_reach(obj)
    if lost is not None:
        layout.label(text=f"They cannot follow “{lost.name}”: it comes after a modifier that changes the vertices", icon="ERROR")


def wanted(settings, name):
    """Whether material and method read a setting; without a library, all of a method are shown."""
    if name in MATERIALS:
        along = name not in ("shear", "direction", "directions") or settings.young_across
        return settings.material in MATERIALS[name] and bool(along) and not (name == "direction" and settings.directions)
    try:
        method = library.package().method.find(settings.method)
    except (ImportError, OSError, ValueError):
        return True
    return {"reduced_fields": method.needs_fields or method.needs_choice, "auto_error": method.needs_choice,
            "force": bool(settings.force_group), "correction_steps": not method.is_full_shell}.get(name, True)


def draw_state(layout, context, obj):
    """What is wrong, else what is."""
    run = live.simulation(obj)
    if live.job(obj) is not None:
        row = layout.row()
        row.label(text=live.job(obj).text(), icon="TIME")
        row.operator("shellwarp.cancel", icon="CANCEL")
    for message in live.trouble(obj) if obj.shellwarp.enabled else []:
        layout.label(text=message, icon="ERROR")
    if obj.shellwarp.enabled and obj.shellwarp.live and not context.scene.render.use_lock_interface:
        layout.prop(context.scene.render, "use_lock_interface", text="Lock interface while rendering", icon="INFO")
    if bake.baked(obj):
        layout.label(text=f"Plays {obj.modifiers[bake.CACHE].filepath}", icon="FILE_CACHE")
        stale = bake.stale(obj)
        layout.label(text=stale or obj.shellwarp.verdict, icon="ERROR" if stale else "NONE")
    elif run is not None:
        layout.label(text=operators.summary(run))
        chosen = run.chosen()
        if chosen:
            layout.label(text=chosen)
        turned = run.turned()
        if turned:
            layout.label(text=turned, icon="INFO")
        touching = run.touching()
        if touching:
            layout.label(text=touching, icon="INFO")
        missed, count = run.unmet()
        if missed:
            layout.label(text=f"{missed} of {count} constraints cannot be met", icon="INFO")
    if run is not None and run.uncalibrated:
        layout.label(text=run.uncalibrated, icon="INFO")
    if run is not None and run.certified and run.certified not in obj.shellwarp.verdict:
        layout.label(text=run.certified)


def draw_handles(layout, settings):
    row = layout.row()
    row.template_list("SHELLWARP_UL_handles", "", settings, "handles", settings, "active_handle", rows=3)
    column = row.column(align=True)
    column.operator("shellwarp.add_handle", text="", icon="ADD")
    column.operator("shellwarp.remove_handle", text="", icon="REMOVE")
    if settings.active_handle < len(settings.handles):
        item = settings.handles[settings.active_handle]
        for name in ("kind", "axes", "compliance"):
            layout.prop(item, name)


def draw_renders(layout, obj):
    """The meshes that follow, and how the proxy itself is kept out of pictures."""
    settings = obj.shellwarp
    layout.label(text="Render meshes that follow")
    row = layout.row()
    row.template_list("SHELLWARP_UL_renders", "", settings, "renders", settings, "active_render", rows=2)
    column = row.column(align=True)
    column.operator("shellwarp.add_render", text="", icon="ADD")
    column.operator("shellwarp.remove_render", text="", icon="REMOVE")
    if len(settings.renders):
        if settings.proxy_vertices:
            layout.prop(settings, "proxy_calibrated")
        layout.prop(obj, "visible_camera", text="Camera sees the proxy")
        layout.prop(obj, "visible_shadow", text="The proxy casts shadows")
        if obj.hide_render and not bake.baked(obj):
            layout.label(text="The proxy is disabled in renders: it moves nothing there until it is baked", icon="ERROR")


class SHELLWARP_PT_collider(bpy.types.Panel):
    """An object as a solid that shells touch."""

    bl_label = "Shellwarp Collider"
    bl_space_type, bl_region_type, bl_context = "PROPERTIES", "WINDOW", "physics"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type in ("MESH", "EMPTY")

    def draw_header(self, context):
        self.layout.prop(context.object.shellwarp_collider, "enabled", text="")

    def draw(self, context):
        obj, layout = context.object, self.layout
        settings = obj.shellwarp_collider
        layout.use_property_split = True
        layout.active = colliders.is_collider(obj)
        layout.prop(settings, "shape")
        if settings.shape == "MESH" or (settings.shape == "AUTO" and not colliders.deforms(obj)):
            layout.prop(settings, "cells")
        is_sheet = colliders.is_sheet(obj, bpy.context.evaluated_depsgraph_get())
        if is_sheet:
            layout.label(text="An open mesh: solid behind its faces, away from their normals", icon="INFO")
        if colliders.modifier(obj) is None:
            layout.prop(settings, "friction")
            layout.prop(settings, "thickness")
            if is_sheet:
                layout.prop(settings, "depth")
        else:
            layout.label(text="Friction and thickness: of the Collision modifier", icon="INFO")
            layout.prop(obj.collision, "cloth_friction")
            layout.prop(obj.collision, "thickness_outer")
            if is_sheet:
                layout.prop(obj.collision, "thickness_inner", text="Depth")
        if any(item.type == "ARMATURE" for item in obj.modifiers):
            layout.operator("shellwarp.fit_capsules")


_CLASSES = (SHELLWARP_UL_handles, SHELLWARP_UL_renders, SHELLWARP_PT_shell, SHELLWARP_PT_collider)


def register():
    for item in _CLASSES:
        bpy.utils.register_class(item)


def unregister():
    for item in reversed(_CLASSES):
        bpy.utils.unregister_class(item)
