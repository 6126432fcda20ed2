"""The shellwarp add-on: thin shells live in the viewport, baked to a point cache, exported to Alembic and USD.

properties.py is what the user sets, panel.py and operators.py what is seen and pressed. inputs.py reads the scene,
simulation.py runs the shell and knows nothing of Blender's data, live.py and bake.py bring its positions back.
"""

bl_info = {  # for "Install legacy Add-on"; blender_manifest.toml is what the extensions system reads
    "name": "Shellwarp",
    "author": "The shellwarp authors",
    "version": (0, 1, 0),
    "blender": (4, 2, 0),
    "location": "Properties > Physics > Shellwarp",
    "description": "Thin shells that bend and swing in real time",
    "category": "Physics",
}

from . import capsules, live, operators, panel, patches, preferences, presets, properties, proxy

_PARTS = (preferences, properties, operators, proxy, capsules, patches, presets, panel, live)


def register():
    for part in _PARTS:
        part.register()


def unregister():
    for part in reversed(_PARTS):
        part.unregister()
