"""Vertices of a job's shell that are held together with others: `tie` tables as of scene files."""

from .errors import SceneError
from .materials import known

KEYS = {"vertices", "triangles", "within", "stiffness"}


def check(where, item):
    """SceneError unless the table is a tie's."""
    known(where, item, KEYS)
    for key in ("vertices", "triangles"):
        pairs = item.get(key, [])
        if not isinstance(pairs, list) or not all(isinstance(pair, list) and len(pair) == 2 and all(isinstance(v, int) for v in pair) for pair in pairs):
            raise SceneError(f"{where}: {key} is {pairs!r}, expected pairs of numbers")
    for key in ("within", "stiffness"):
        if key in item and not item[key] > 0:
            raise SceneError(f"{where}: {key} is {item[key]!r}, expected a number above 0")
    if not set(item) & {"vertices", "triangles", "within"}:
        raise SceneError(f"{where}: a tie needs vertices, triangles or within")
    if "within" in item and "stiffness" in item:
        raise SceneError(f"{where}: what touches is tied stiffly: stiffness goes with vertices or triangles")


def parts_of(items, simulated):
    """What a Shell takes of the tables."""
    if simulated.is_other and any("triangles" in item for item in items):
        raise SceneError("tie: triangles are numbered anew by weld and proxy: tie by vertices or within")
    stiffness = [[float(item["stiffness"])] if "stiffness" in item else [] for item in items]
    return {"ties": [(simulated.here(a), simulated.here(b), *stiff) for item, stiff in zip(items, stiffness) for a, b in item.get("vertices", [])],
            "triangle_ties": [(simulated.here(a), t, *stiff) for item, stiff in zip(items, stiffness) for a, t in item.get("triangles", [])],
            "tie_distance": float(max((item.get("within", 0) for item in items), default=0))}
