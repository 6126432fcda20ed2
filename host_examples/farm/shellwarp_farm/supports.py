"""What holds a job's shell, along which axes, and where it moves: `support` tables as of scene files."""

import numpy

from . import motion, samples, selection, way
from .errors import SceneError
from .handles import check_axes
from .simulated import mesh_at, simulated_at, whole_of

KEYS = selection.WHERE | {"kind", "axes", "symmetric", "key", "about"}
FIELDS = 24   # support_fields where a support has a key and nobody says how many


def check(where, item):
    """SceneError unless the table is a support's; all of its keys are known."""
    if item.get("kind", "fixed") not in ("fixed", "clamped"):
        raise SceneError(f"{where}: the kind of a support is 'fixed' or 'clamped'")
    selection.check(where, item)
    check_axes(where, item)
    if "axes" in item and (item.get("kind", "fixed") != "fixed" or "key" in item):
        raise SceneError(f"{where}: axes go with a fixed support without a key")
    if item.get("symmetric", False) not in (True, False):
        raise SceneError(f"{where}: symmetric is true or false")
    if "symmetric" in item and "axes" not in item:
        raise SceneError(f"{where}: symmetric goes with axes, the normals of the planes of symmetry")
    if "about" in item and "key" not in item:
        raise SceneError(f"{where}: about goes with key")
    way.check_vector(where, item, "about")
    way.check(where, item.get("key", []))


def at_rest(supports):
    """The tables without what moves them: what a model is made of."""
    return [{key: value for key, value in item.items() if key not in ("key", "about")} for item in supports]


def any_moves(supports):
    """Whether some move against the others or the frame."""
    return any(item.get("key") for item in supports)


def held_vertices(supports, simulated, mesh):
    """The vertices that supports hold, clamped ones with their neighbours, sorted and each once: (k), uint32."""
    held = numpy.zeros(len(simulated.positions), dtype=bool)
    for support in supports:
        if "axes" not in support:
            held[with_neighbours(support, simulated, mesh)] = True
    return numpy.flatnonzero(held).astype(numpy.uint32)


def with_neighbours(support, simulated, mesh):
    """The vertices of a support, clamped ones with those that share a triangle with one: on a proxy, whose edges are long, the neighbours are those on the mesh that it stands for."""
    if support.get("kind", "fixed") == "fixed":
        return selection.chosen(support, simulated, mesh)
    if not simulated.is_other:
        return _grown(selection.chosen(support, simulated, mesh), simulated.triangles)
    asset = mesh_at(mesh)
    wide = _grown(selection.chosen(support, whole_of(asset), mesh), asset[1])
    held = numpy.unique([simulated.here(int(vertex)) for vertex in wide])
    inside = simulated.triangles[numpy.isin(simulated.triangles, held).all(axis=1)]   # these hold their slope
    return numpy.union1d(held, _grown(numpy.setdiff1d(held, inside), simulated.triangles))


def _grown(vertices, triangles):
    return numpy.union1d(vertices, triangles[numpy.isin(triangles, vertices).any(axis=1)])


def supported_vertices(supports, simulated, mesh, kind):
    """The vertices that supports of a kind name, sorted and each once: (k), uint32."""
    chosen = [selection.chosen(support, simulated, mesh) for support in supports if support.get("kind", "fixed") == kind and "axes" not in support]
    return numpy.unique(numpy.concatenate([numpy.zeros(0, int), *chosen])).astype(numpy.uint32)


def axes_of(supports, simulated, mesh):
    """What a Shell takes of vertices that are held along axes, and of those on planes of symmetry."""
    found = {"axes": {}, "symmetric": {}}
    for support in supports:
        of = found["symmetric" if support.get("symmetric") else "axes"]
        for vertex in selection.chosen(support, simulated, mesh) if "axes" in support else ():
            of[int(vertex)] = "".join(sorted({*of.get(int(vertex), ""), *support["axes"]}))
    return found


def led_supports(job):
    """What moves supports along keys: their vertices, the point that they turn about, and the keys."""
    if not any_moves(job["support"]):
        return []
    simulated, found = simulated_at(job), []
    for item in job["support"]:
        if item.get("key"):
            middle = simulated.positions[selection.chosen(item, simulated, job["mesh"])].mean(axis=0)
            found.append((with_neighbours(item, simulated, job["mesh"]), numpy.array(item.get("about", middle), float), item["key"]))
    return found


class Supports:
    """Moves the supports of a job that have keys, or that its mesh is animated with, and the frame."""

    def __init__(self, job):
        self._job, self._frame, self._led = job, job["frame"], led_supports(job)
        simulated = simulated_at(job)
        self._rest, self._carried, self._is_other = simulated.positions, simulated.carried, simulated.is_other

    def begin(self, state, seconds, end):
        """Where they are when a shot begins from rest."""
        self.move(state, seconds, end, teleport=True)
        if self._job["follow_rest"]:
            state.reset()   # it is there, and does not jump there in the first step

    def move(self, state, seconds, end, teleport=False):
        """Where they are at a time; `end` is that of the shot. A vertex of several supports goes with the last."""
        if self._job["motion"]:
            (state.move_rest if self._job["follow_rest"] else state.move_supports)(self._animated(seconds), teleport)
            return
        if not self._led:
            if self._frame:
                state.set_frame(*motion.pose(self._frame, seconds, end), teleport=teleport)
            return
        positions = self._rest.copy()
        for vertices, about, keys in self._led:
            offset, turn = way.at(keys, seconds)
            positions[vertices] = about + offset + (self._rest[vertices] - about) @ motion.rotation_matrix(numpy.radians(turn)).T
        if self._frame:
            origin, rotation = motion.pose(self._frame, seconds, end)
            positions = positions @ rotation.T + origin
        state.move_supports(positions, teleport)

    def _animated(self, seconds):
        """Where the mesh's animation has each vertex at a time; of another mesh in its place as far from it as the mesh's are from the mesh."""
        job = self._job
        points = samples.points_at(job["motion"], job["mesh"], seconds, job["simulation"]["frame_rate"])
        return self._rest + self._carried(points - mesh_at(job["mesh"])[0]) if self._is_other else points
