"""Presets of a shell's settings: the button in the head of the panel, as Blender's own physics have it."""

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

# What is the shell's nature, and not of one mesh, scene or file.
KEPT = ("material", "preset", "frequency", "sag", "young", "poisson", "young_across", "shear", "thickness", "volume_density", "density",
        "k_bend", "k_length", "k_area", "method", "reduced_fields", "auto_error", "modes", "correction_steps", "push_out", "integrator",
        "precision", "support_fields", "damping_ratio", "damping_mass", "damping_stiffness", "stiffness_factor", "gravity", "fields",
        "air_density", "normal_drag", "tangential_drag", "steps_per_frame")


class SHELLWARP_PT_presets(PresetPanel, bpy.types.Panel):
    """The saved settings."""

    bl_label = "Shellwarp presets"
    preset_subdir = "shellwarp"
    preset_operator = "script.execute_preset"
    preset_add_operator = "shellwarp.preset_add"


class SHELLWARP_OT_preset_add(AddPresetBase, bpy.types.Operator):
    """Save material, method, damping and air of this shell under a name, or remove a preset"""

    bl_idname = "shellwarp.preset_add"
    bl_label = "Add shellwarp preset"
    preset_menu = "SHELLWARP_PT_presets"
    preset_subdir = "shellwarp"
    preset_defines = ["shell = bpy.context.object.shellwarp"]
    preset_values = [f"shell.{name}" for name in KEPT]


def register():
    bpy.utils.register_class(SHELLWARP_PT_presets)
    bpy.utils.register_class(SHELLWARP_OT_preset_add)


def unregister():
    bpy.utils.unregister_class(SHELLWARP_OT_preset_add)
    bpy.utils.unregister_class(SHELLWARP_PT_presets)
