"""Where the library is, for those who build their own."""

import bpy


class ShellwarpPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    library: bpy.props.StringProperty(
        name="Library", subtype="FILE_PATH",
        description="A libshellwarp to use instead of the add-on's own; read when the first shell is made in a session")

    def draw(self, _context):
        from . import library
        self.layout.prop(self, "library")
        try:
            package = library.package()
            self.layout.label(text=f"shellwarp {package.version()}, {package.library_path()}")
        except (ImportError, OSError) as error:
            self.layout.label(text=str(error), icon="ERROR")


def library_path():
    """The file chosen, "" for none."""
    addon = bpy.context.preferences.addons.get(__package__)
    path = addon.preferences.library if addon and addon.preferences else ""
    return bpy.path.abspath(path) if path else ""


def register():
    bpy.utils.register_class(ShellwarpPreferences)


def unregister():
    bpy.utils.unregister_class(ShellwarpPreferences)
