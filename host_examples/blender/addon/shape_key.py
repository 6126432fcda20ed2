"""Where live positions go: the shape key “shellwarp”. The basis stays the rest shape, and the file keeps both."""

from .meshes import writable

SHAPE_KEY = "shellwarp"


def write(obj, positions):
    """Shows positions (n x 3), object coordinates."""
    mesh = obj.data
    if mesh.shape_keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
    block = mesh.shape_keys.key_blocks.get(SHAPE_KEY)
    if block is None:
        block = obj.shape_key_add(name=SHAPE_KEY, from_mix=False)
        block.value = 1.0
    block.data.foreach_set("co", positions.ravel())
    mesh.shape_keys.update_tag()
    mesh.update_tag()


def remove(obj):
    """Takes the key away, and the basis with it when nothing else is left: exporters treat meshes with keys apart."""
    if not writable(obj):
        return
    keys = obj.data.shape_keys
    block = keys.key_blocks.get(SHAPE_KEY) if keys else None
    if block is not None:
        obj.shape_key_remove(block)
    if obj.data.shape_keys and len(obj.data.shape_keys.key_blocks) == 1 and block is not None:
        obj.shape_key_remove(obj.data.shape_keys.key_blocks[0])
