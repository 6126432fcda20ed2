"""A small list, and the mesh it bakes: a strip of card, 13 x 3 vertices, held at one end."""

from pathlib import Path

from shellwarp_farm.scenes import expand, read_list

LIST = """
seeds = [1, 2]
[[asset]]
name = "card"
mesh = "card.obj"
material = { k_area = 5e3, k_length = 5e3, k_bend = 2.7e-3, density = 0.3 }
support = [{ kind = "fixed", vertices = [0, 1, 2, 3, 4, 5] }]
simulation = { modes = 6, method = "warp" }
damping = { ratio = 0.05 }
[parameters]
"material.k_bend" = [2.7e-3, 5e-3]
[[shot]]
name = "one"
frames = [0, 5]
simulation = { gravity = [0, 0, -1], steps_per_frame = 2 }
wind = { velocity = [0, 1, 0], gust = 0.5 }
[[shot]]
name = "two"
after = "one"
frames = [6, 11]
simulation = { gravity = [0, 0, -1], steps_per_frame = 2 }
wind = { velocity = [0, 1, 0], gust = 0.5 }
"""


def write_obj(path, length=0.01):
    rows = [f"v {length * i:.17g} {0.01 * j:.17g} 0" for i in range(13) for j in range(3)]
    for i in range(12):
        for j in range(2):
            a = 3 * i + j + 1
            rows += [f"f {a} {a + 3} {a + 4}", f"f {a} {a + 4} {a + 1}"]
    Path(path).write_text("\n".join(rows) + "\n")


def write_list(folder, text=LIST):
    """The list and its mesh in a folder: the list's path."""
    write_obj(Path(folder) / "card.obj")
    path = Path(folder) / "list.toml"
    path.write_text(text)
    return path


def jobs(folder, text=LIST):
    return expand(read_list(write_list(folder, text)))
