"""One shell's run: which frames are known, and how the next one is reached. Knows nothing of Blender's data.

Frame by frame the state is saved (under a kilobyte) together with the inputs that led to it. A frame that is known is
restored, so scrubbing back is exact; if its inputs have changed meanwhile, it and all later ones are dropped and stepped
anew. Between whole frames a copy is stepped by the fraction: motion blur never advances the run.
"""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy
from mathutils import Matrix, Vector

from .inputs import Refused


DEEP = 1e-3  # of the mesh's size: deeper than this is seen


@dataclass(frozen=True)
class Known:
    """A frame that was reached."""

    saved: bytes
    inputs: object


class Simulation:
    """Model, state and known frames of one shell."""

    def __init__(self, package, shell, scale, recipe, key, progress=None):
        self.key, self.scale = key, scale
        self._rest = numpy.asarray(shell.positions / scale, numpy.float32)
        self.model = package.Model(shell)
        self.model.precompute(progress=progress, **dict(recipe.options))
        missing = self.model.lacks(recipe.method)
        if missing:
            raise Refused(missing)
        self._state = self.model.state(recipe.method, recipe.integrator)
        slowest = next((hertz for hertz in self.model.frequencies() if hertz > 0), 0.0)
        self._damping = partial(package.method.damping, package.method.find(recipe.method), slowest=slowest)
        self._at = None
        self.certified = ""  # what the last certificate said, of the frame that it names
        self.known, self.solids = {}, ()
        self.bound, self.drawn = (), ()  # the meshes that follow, and their points (n x 3) beside the shell at the frame last gone to
        self.groups = {}  # the vertex groups that the model was made with, by what they are for
        self._buffer = numpy.empty_like(self._rest)

    def close(self):
        """Frees the library's memory now."""
        for item in self.bound:
            item.binding.close()
        self._state.close()
        self.model.close()

    def collide(self, solids):
        """Takes prepared colliders for a run that begins; others than before drop all frames."""
        if [item.digest for item in solids] != [item.digest for item in self.solids]:
            self._state.set_colliders([item.shape for item in solids])
            self.forget()
        self.solids = solids

    def follow(self, bound):
        """Takes meshes that are bound; frames do not depend on them."""
        kept = {item.digest for item in bound}
        for item in self.bound:
            if item.digest not in kept:
                item.binding.close()
        self.bound = bound

    def forget(self):
        """Drops all frames."""
        self.known.clear()
        self._at, self.certified = None, ""

    def go(self, frame, start, inputs):
        """Positions (n x 3) float32 in the object's coordinates at `frame`, which may lie between two.

        Raises Refused when the frame before has not been reached: the way there is not known.
        """
        whole = math.floor(frame)
        if frame < start:
            self.drawn = [item.rest for item in self.bound]
            return self._rest
        if frame > whole:
            return self._between(whole, frame - whole, inputs)
        if whole == start:
            self._begin(start, inputs)
        elif whole in self.known and self.known[whole].inputs == inputs:
            self._restore(whole)
        else:
            self._advance(whole, inputs)
        return self._positions(self._state)

    def report(self):
        """Energies and turns of the present frame; see State.report."""
        return self._state.report()

    def turned(self):
        """What to say of turns beyond what the method's rotations are good for, "" for nothing. Of the error it says nothing."""
        report = self.report()
        if report["turn_in_range"]:
            return ""
        share = math.ceil(100 * report["fraction_turned_too_far"])
        return f"turns by {math.degrees(report['max_rotation']):.0f} degrees, {share} % of it too far for the method: certify it"

    def touching(self):
        """What to say of contact, "" for nothing."""
        if not self.solids:
            return ""
        report = self.report()
        text = f"touches at {report['contact_count']} points"
        deepest, size = report["deepest_penetration"], float(numpy.ptp(self._rest, axis=0).max() * self.scale)
        return text + (f", {deepest:.2g} deep inside: more modes help" if deepest > DEEP * size else "")

    def certify(self):
        """How far the present frame is from the full nonlinear shell, estimated: a sentence, kept for the panel."""
        if self._at is None:
            raise Refused("go to the start frame and play from there")
        self.certified = f"frame {self._at}: {told(self._state.certify())}"
        return self.certified

    def unmet(self):
        """How many handles the last step could not meet, and how many there are."""
        reports = self._state.constraint_report()
        return sum(not r["met"] for r in reports), len(reports)

    def _begin(self, start, inputs):
        known = self.known.get(start)
        if known is not None and known.inputs == inputs:
            self._restore(start)
            return
        self.forget()
        self._state.reset()
        apply(self._state, inputs, self._damping, teleport=True)
        self.known[start] = Known(self._state.save(), inputs)
        self._at = start

    def _restore(self, frame):
        if self._at != frame:
            self._state.load(self.known[frame].saved)
            self._at = frame

    def _advance(self, frame, inputs):
        if frame - 1 not in self.known:
            last = max((f for f in self.known if f < frame), default=None)
            raise Refused("go to the start frame and play from there" if last is None else
                          f"frames were skipped after {last}: play every frame, or bake")
        self._restore(frame - 1)
        for later in [f for f in self.known if f >= frame]:
            del self.known[later]
        self._at = None  # should a step fail, the state is between two frames
        step(self._state, self.known[frame - 1].inputs, inputs, 1.0, self._damping)
        self.known[frame] = Known(self._state.save(), inputs)
        self._at = frame

    def _between(self, whole, fraction, inputs):
        if whole not in self.known:
            raise Refused(f"frame {whole} has not been reached: play every frame, or bake")
        with self._state.clone() as copy:
            copy.load(self.known[whole].saved)
            step(copy, self.known[whole].inputs, inputs, fraction, self._damping)
            return self._positions(copy)

    def _positions(self, state):
        self.drawn = [state.bound_points(item.binding, space="frame")["positions"] for item in self.bound]
        state.positions(self._buffer, space="frame")
        if self.scale != 1.0:
            numpy.divide(self._buffer, self.scale, out=self._buffer)
        return self._buffer


def told(certificate):
    """A certificate in words."""
    percent = 100 * certificate["error"]
    number = f"{percent:.2g}" if percent < 10 else f"{percent:.0f}"
    text = f"about {number} % off the full nonlinear shell" + (", roughly" if certificate["remaining"] > 0.01 else "")
    return text + ("; more modes or less load would help" if certificate["out_of_range"] else "")


def step(state, before, after, fraction, damping):
    """Steps by a part of a frame, pose and handles led evenly from the one inputs to the other. `damping` is as of apply."""
    for k in range(1, after.steps_per_frame + 1):
        now = blend(before, after, k / after.steps_per_frame)
        apply(state, now, damping)
        state.step(fraction * after.seconds / after.steps_per_frame)


def apply(state, inputs, damping, teleport=False):
    """Gives all inputs to a state. `damping` makes of ratio, mass and stiffness what the method takes."""
    state.set_gravity(inputs.gravity)
    state.set_damping(**damping(*inputs.damping))
    state.set_wind(inputs.wind[:3], *inputs.wind[3:])
    state.clear_constraint()
    for handle in inputs.handles:
        state.set_constraint(handle.number, handle.kind, handle.vertex, handle.position or None, handle.rotation or None,
                             handle.axes, handle.compliance)
    state.set_frame(inputs.origin, inputs.rotation, teleport)
    for number, solid in enumerate(inputs.solids):
        state.move_collider(number, solid.origin, solid.rotation, teleport)


def blend(before, after, t):
    """Inputs on the way: loads as at the end, pose and handles between; a handle that is new stands where it ends."""
    if t == 1.0:
        return after
    earlier = {handle.number: handle for handle in before.handles}
    handles = tuple(blend_handle(earlier.get(handle.number, handle), handle, t) for handle in after.handles)
    solids = tuple(replace(b, origin=lerp(a.origin, b.origin, t), rotation=turn(a.rotation, b.rotation, t))
                   for a, b in zip(before.solids, after.solids))
    return replace(after, origin=lerp(before.origin, after.origin, t), handles=handles, solids=solids,
                   rotation=turn(before.rotation, after.rotation, t))


def blend_handle(before, after, t):
    if before.kind != after.kind:
        return after
    return replace(after, position=lerp(before.position, after.position, t),
                   rotation=turn(before.rotation, after.rotation, t) if after.rotation else ())


def lerp(a, b, t):
    return tuple(Vector(a).lerp(Vector(b), t)) if b else ()


def turn(a, b, t):
    first, last = (Matrix((m[0:3], m[3:6], m[6:9])).to_quaternion() for m in (a, b))
    between = first.slerp(last, t).normalized()  # straight, and so too short by 1e-4, where the two are near each other
    return tuple(x for row in between.to_matrix() for x in row)
