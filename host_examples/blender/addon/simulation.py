"""One shell's run: which frames are known, and how the next one is reached. Knows nothing of Blender's data.

Frame by frame the state is saved (under a kilobyte) together with the inputs that led to it. A frame that is known is
restored, so scrubbing back is exact; if its inputs have changed meanwhile, it and all later ones are dropped and stepped
anew. Between whole frames a copy is stepped by the fraction: motion blur never advances the run.
"""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy

from . import fields
from .blend import blend
from .inputs import Output, Refused
from .jobs import Estimate


BENT = 1e-5  # of the mesh's size: supports that are less off a rigid motion are off it by rounding
KEPT = 16  # from so many to so many frames a state is kept whole, where what is saved of it does not do
DEEP = 1e-3  # of the mesh's size: deeper than this is seen


@dataclass(frozen=True)
class Known:
    """A frame that was reached."""

    saved: bytes
    inputs: object
    whole: object = None  # a copy of the state, kept of some frames where a rest shape moves, whose motion is not saved


class Simulation:
    """Model, state and known frames of one shell."""

    def __init__(self, package, shell, scale, recipe, key, progress=None, calibrate=None):
        self.key, self.scale, self.recipe, self.held = key, scale, recipe, held(shell)
        self._areas, self._package = areas(shell), package
        self._rest = numpy.asarray(shell.positions / scale, numpy.float32)
        fit = None if calibrate is None else partial(calibrate, shell=shell)
        if recipe.frequency:
            shell = package.look.at_frequency(shell, recipe.frequency, dict(recipe.options)["modes"], progress, fit)
        if recipe.sag:
            shell = package.look.at_sag(shell, recipe.sag[0], recipe.sag[1:], modes=dict(recipe.options)["modes"], progress=progress, calibrate=fit)
        self.model = package.Model(shell)
        found = fit(self.model) if fit else None
        self.calibration = None if isinstance(found, str) else found
        self.uncalibrated = f"the proxy is not as stiff as the mesh that it stands for: {found}" if isinstance(found, str) else ""
        try:
            self.model.precompute(progress=progress, **dict(recipe.options))
        except Exception as error:
            if "support_fields" in str(error):  # what a user has of them is a switch
                raise Refused(f"{error}; or switch Pins follow off") from error
            raise
        missing = self.model.lacks(recipe.method)
        if missing:
            raise Refused(missing)
        self._state = self.model.state(recipe.method, recipe.integrator)
        method = package.method.find(self.model.info()["auto_method"] if recipe.method == "auto" else recipe.method)
        self._full = method.is_full_shell
        self._at, self._failed = None, (None, "")  # the frame that the state is at; the frame that a step could not reach, and why
        self.certified = ""  # what the last certificate said, of the frame that it names
        self.known, self.solids, self._factors, self._shares = {}, (), None, None
        self.bound, self.drawn = (), ()  # the meshes that follow, and their points (n x 3) beside the shell at the frame last gone to
        self.groups = {}  # the vertex groups that the model was made with, by what they are for
        self._buffer = numpy.empty_like(self._rest)
        self._output, self._left = Output(), None  # what is done to what is shown; how deep push-out leaves it

    def close(self):
        """Frees the library's memory now."""
        for item in self.bound:
            item.binding.close()
        self._state.close()
        self.model.close()

    def vary(self, factors, shares):
        """Takes factors of damping and shares of the force at the vertices for a run that begins, None for none; others than before drop all frames."""
        if not (numpy.array_equal(factors, self._factors) and numpy.array_equal(shares, self._shares)):
            self.forget()
        self._factors, self._shares = factors, shares

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
        self._at, self.certified, self._failed = None, "", (None, "")

    def go(self, frame, start, inputs, output=Output()):
        """Positions (n x 3) float32 in the object's coordinates at `frame`, which may lie between two.

        No later frame depends on what `output` asks for.

        Raises Refused when the frame before has not been reached: the way there is not known.
        """
        self._output = output if frame > start else Output()  # it begins in its rest shape
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
        return self._positions(self._state, inputs)

    def report(self):
        """Energies and turns of the present frame; see State.report."""
        return self._state.report()

    def chosen(self):
        """What the automatic choice took, and why it is not a reduced shell, "" for a method that was named."""
        if self.recipe.method != "auto":
            return ""
        info = self.model.info()
        taken = self._package.method.find(info["auto_method"])
        if taken.is_full_shell and info["auto_corrects"]:
            return f"Automatic: {taken.label}; fields miss {100 * info['training_error_median']:.0f} % or more in half of their training"
        why = "" if taken.needs_fields else self.model.lacks("reduced-shell").replace("ask for reduced_poses", "choose Reduced shell to wait for it")
        return f"Automatic: {taken.label}" + (f"; {why}" if why else "")

    def turned(self):
        """What to say of turns beyond what the method's rotations are good for, "" for nothing. Of the error it says nothing."""
        report = self.report()
        if report["turn_in_range"]:
            return ""
        share = math.ceil(100 * report["fraction_turned_too_far"])
        return f"turns by {math.degrees(report['max_rotation']):.0f} degrees, {share} % of it too far for the method: certify it"

    def memory(self):
        """Bytes: of model, state and kept frames now, and the most at once while the model was made, estimated."""
        info = self.model.info()
        kept = sum(len(frame.saved) + len(frame.inputs.supports) + len(frame.inputs.rest) * (10 if frame.whole else 1) +
                   sum(len(solid.points) for solid in frame.inputs.solids) for frame in self.known.values())
        return info["bytes_model"] + info["bytes_state"] + kept, info["bytes_precompute_peak"]

    def touching(self):
        """What to say of contact, "" for nothing."""
        if not self.solids:
            return ""
        report = self.report()
        text = f"touches at {report['contact_count']} points"
        deepest, size = report["deepest_penetration"], float(numpy.ptp(self._rest, axis=0).max() * self.scale)
        if deepest > DEEP * size:
            text += f", {deepest:.2g} deep inside: more modes help, and contact patches"
        if self._left is not None:
            text += f"; shown pushed out, {self._left:.2g} deep left" if self._left > DEEP * size else "; shown pushed out"
        return text

    def estimate(self):
        """How far the present frame is from the full nonlinear shell, on a thread: an Estimate, for `certify`."""
        return Estimate(*self.copied())

    @property
    def is_full(self):
        """Whether it is the full shell, which others are judged by."""
        return self._full

    def copied(self):
        """A copy of the state at the present frame, for whoever closes it, and the frame."""
        if self._at is None:
            raise Refused("go to the start frame and play from there")
        return self._state.clone(), self._at

    def certify(self, *estimates):
        """What estimates said, of the present frame unless told otherwise: the worst, and the last where that is another. Kept for the panel."""
        estimates = estimates or (self.estimate(),)
        worst = max(estimates, key=lambda estimate: estimate.result()["error"])
        self.certified = "; ".join(f"frame {e.frame}: {told(e.result(), self._output.correction_steps > 0)}" for e in dict.fromkeys((worst, estimates[-1])))
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
        try:
            self._place(inputs)
        except Exception as error:
            self._failed = start, str(error) or type(error).__name__
            raise
        self.known[start] = self._kept(start, inputs)
        self._at = start

    def _place(self, inputs):
        """Puts the state where a run begins."""
        self._state.set_frame(inputs.origin, inputs.rotation, teleport=True)  # supports that are led begin to look for theirs here
        self._lead_rest(self._state, inputs, teleport=True)
        self._state.reset()
        if self._full and inputs.supports:  # it has supports moved and nothing else: let it rest there
            self._apply(self._state, replace(inputs, gravity=(0, 0, 0), wind=(0,) * 6, fields=(), handles=()), teleport=True)
            self._settle()
        self._apply(self._state, inputs, teleport=True)

    def _kept(self, frame, inputs):
        """What is kept of the state at a frame."""
        first = min(self.known, default=frame)
        return Known(self._state.save(), inputs, self._state.clone() if inputs.rest and (frame - first) % KEPT == 0 else None)

    def _settle(self):
        """Lets a shell whose supports are not as at rest find where it rests."""
        rest = self._rest * self.scale
        off = self._state.positions(space="frame")[self.held] - rest[self.held]
        if numpy.abs(off).max() > BENT * numpy.ptp(rest, axis=0).max():
            try:
                self._state.equilibrium()
            except Exception as error:
                raise Refused(f"the shell finds no rest where its pins are at the start: begin in a pose nearer to the rest shape ({error})") from error

    def _restore(self, frame):
        if self._at != frame:
            before, self._at = self._state, None
            self._state = self._brought(before, frame)
            if self._state is not before:
                before.close()
            self._at = frame

    def _brought(self, state, frame):
        """A state at a known frame, with those of its inputs that a saved state goes by and has not: the given one, unless its rest shape moves."""
        known = self.known[frame]
        if known.inputs.rest:
            return self._again(frame)
        deform(state, known.inputs.solids, teleport=True)
        state.set_stiffness(known.inputs.stiffness_factor)
        state.load(known.saved)
        return state

    def _again(self, frame):
        """A new state at a known frame, by the steps from the last frame before that was kept whole."""
        at = max(f for f, known in self.known.items() if f <= frame and known.whole is not None)
        state = self.known[at].whole.clone()
        for k in range(at + 1, frame + 1):
            self._step(state, self.known[k - 1].inputs, self.known[k].inputs, 1.0)
        return state

    def _advance(self, frame, inputs):
        if frame - 1 not in self.known:
            last = max((f for f in self.known if f < frame), default=None)
            if self._failed[0] is not None and (last is None or self._failed[0] == last + 1):
                raise Refused(f"frame {self._failed[0]}: {self._failed[1]}")
            raise Refused("go to the start frame and play from there" if last is None else
                          f"frames were skipped after {last}: play every frame, or bake")
        self._restore(frame - 1)
        for later in [f for f in self.known if f >= frame]:
            del self.known[later]
        self._at = None  # should a step fail, the state is between two frames
        try:
            self._step(self._state, self.known[frame - 1].inputs, inputs, 1.0)
        except Exception as error:
            self._failed = frame, str(error) or type(error).__name__
            raise
        self._failed = None, ""
        self._correct()
        self.known[frame] = self._kept(frame, inputs)
        self._at = frame

    def _correct(self):
        """Leads what is shown on from the frame before. Where that fails, the motion goes on, and reading what is shown says why."""
        try:
            self._state.correct(self._output.correction_steps)
        except self._package.ShellwarpError:
            self._state.correct(0)

    def _between(self, whole, fraction, inputs):
        if whole not in self.known:
            raise Refused(f"frame {whole} has not been reached: play every frame, or bake")
        with self._state.clone() as copy, self._brought(copy, whole) as there:
            self._step(there, self.known[whole].inputs, inputs, fraction)
            return self._positions(there, inputs)

    def _positions(self, state, inputs):
        read = self._reader(state)
        if inputs.supports or inputs.rest:  # the frame goes with them, and the object where it likes
            origin, rotation = numpy.array(inputs.origin), numpy.reshape(inputs.rotation, (3, 3))
            points = [state.bound_points(item.binding, dtype=numpy.float64, **self._moved())["positions"] for item in self.bound]
            self.drawn = [((found - origin) @ rotation).astype(numpy.float32) for found in points]
            self._buffer[:] = (read(dtype=numpy.float64) - origin) @ rotation / self.scale
            return self._buffer
        self.drawn = [state.bound_points(item.binding, space="frame", **self._moved())["positions"] for item in self.bound]
        read(self._buffer, space="frame")
        if self.scale != 1.0:
            numpy.divide(self._buffer, self.scale, out=self._buffer)
        return self._buffer

    def _moved(self):
        """The same of points that follow, as State.bound_points has it."""
        return {"correction_steps": self._output.correction_steps, "outside": self._output.push_out and bool(self.solids)}

    def _reader(self, state):
        """What reads a state's positions, as State.positions does, with what is to be done to them."""
        steps, push_out = self._output.correction_steps, self._output.push_out and bool(self.solids)
        self._left = None
        if steps:
            return partial(state.positions_corrected, steps)
        return partial(self._pushed_out, state) if push_out else state.positions

    def _pushed_out(self, state, out=None, space="world", dtype=numpy.float32):
        points, self._left = state.positions_outside(space, dtype)
        if out is not None:
            out[:] = points
        return points

    def _step(self, state, before, after, fraction):
        """Steps by a part of a frame, pose and handles led evenly from the one inputs to the other."""
        for k in range(1, after.steps_per_frame + 1):
            self._apply(state, blend(before, after, k / after.steps_per_frame))
            state.step(fraction * after.seconds / after.steps_per_frame)

    def _lead_rest(self, state, inputs, teleport=False):
        if inputs.rest:
            state.move_rest(numpy.frombuffer(inputs.rest).reshape(-1, 3), teleport)

    def _apply(self, state, inputs, teleport=False):
        """Gives all inputs to a state."""
        state.set_gravity(inputs.gravity)
        state.set_stiffness(inputs.stiffness_factor)
        state.set_damping(*inputs.damping, factors=self._factors)
        air, push = fields.at(inputs.fields, state.positions(dtype=numpy.float64)) if inputs.fields else (None, None)
        state.set_wind(inputs.wind[:3], *inputs.wind[3:], local_velocities=air)
        forces = None if push is None else push * self._areas
        if any(inputs.force):
            forces = (0 if forces is None else forces) + self._shares[:, None] * numpy.array(inputs.force)
        state.set_forces(forces)
        state.clear_constraint()
        for handle in inputs.handles:
            state.set_constraint(handle.number, handle.kind, handle.vertex, handle.position or None, handle.rotation or None,
                                 handle.axes, handle.compliance)
        if inputs.supports:
            places = numpy.zeros((self.model.n_vertices, 3))
            places[self.held] = numpy.frombuffer(inputs.supports).reshape(-1, 3)
            state.move_supports(places, teleport)
        elif inputs.rest:
            if not teleport:  # a run that begins is there already, without a jump to come
                self._lead_rest(state, inputs)
        else:
            state.set_frame(inputs.origin, inputs.rotation, teleport)
        for number, solid in enumerate(inputs.solids):
            state.move_collider(number, solid.origin, solid.rotation, teleport)
        deform(state, inputs.solids, teleport)


def deform(state, solids, teleport=False):
    """Gives deforming colliders the shapes that they are to have at the end of the next step."""
    for number, solid in enumerate(solids):
        if solid.points:
            state.deform_collider(number, numpy.frombuffer(solid.points, numpy.float32).reshape(-1, 3), teleport)


def areas(shell):
    """The area of each vertex (n x 1): a third of its triangles."""
    points, faces = numpy.asarray(shell.positions, numpy.float64), numpy.asarray(shell.triangles)
    sides = points[faces[:, 1:]] - points[faces[:, :1]]
    third = numpy.linalg.norm(numpy.cross(sides[:, 0], sides[:, 1]), axis=1) / 6
    return numpy.bincount(faces.ravel(), numpy.repeat(third, 3), len(points))[:, None]


def held(shell):
    """The vertices that a shell's supports may hold, ascending: fixed and clamped ones, and the neighbours of the latter."""
    faces = numpy.asarray(shell.triangles)
    near = faces[numpy.isin(faces, shell.clamped).any(axis=1)]
    return numpy.unique(numpy.concatenate([numpy.asarray(part, numpy.int64).ravel() for part in (shell.fixed, shell.clamped, near)]))


def percent(share):
    """A share in words: percent of two digits, or without decimals."""
    if share < 1e-4:
        return "less than 0.01 %"
    return f"about {100 * share:.2g} %" if share < 0.1 else f"about {100 * share:.0f} %"


def told(certificate, corrected):
    """A certificate in words; where what is shown is corrected, with the error that this leaves."""
    text = f"{percent(certificate['error'])} off the full nonlinear shell" + (", roughly" if certificate["remaining"] > 0.01 else "")
    if corrected and certificate["corrected_error"] != certificate["error"]:
        text += f"; as shown, after Newton steps, {percent(certificate['corrected_error'])}"
    return text + ("; more modes or less load would help" if certificate["out_of_range"] else "")
