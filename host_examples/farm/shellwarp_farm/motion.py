"""What changes from step to step by a formula: the shaken support frame, as in host_examples/cli/frame_motion.hpp, and gusts."""

import hashlib
import math

import numpy

GUSTS = 4        # sinusoids of a gust
SPACING = 1.618  # of their frequencies, in those of the first; not a whole number, so that they do not repeat together


def pose(frame, seconds, end):
    """The support frame of a [frame] table at a time: origin (3) and rotation (3 x 3). `end` is that of the shot."""
    envelope = smooth_step(seconds / frame.get("rise", 1)) * smooth_step((frame.get("end", end) - seconds) / frame.get("fall", 1))
    pivot = numpy.array(frame.get("pivot", (0.0, 0.0, 0.0)), dtype=float)
    shift = envelope * _sum(frame.get("translate", ()), seconds)
    rotation = rotation_matrix(numpy.radians(envelope * _sum(frame.get("rotate_degrees", ()), seconds)))
    return pivot + shift - rotation @ pivot, rotation


def rotation_matrix(r):
    """exp [r]× of a rotation vector."""
    angle = math.sqrt(float(r @ r))
    a = math.sin(angle) / angle if angle > 0 else 1.0
    b = 0.5 * (math.sin(angle / 2) / (angle / 2)) ** 2 if angle > 0 else 0.5
    cross = numpy.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    return numpy.eye(3) + a * cross + b * cross @ cross


def smooth_step(x):
    """0 to 1 over 0 <= x <= 1, first and second derivative 0 at both ends."""
    x = min(max(x, 0.0), 1.0)
    return x * x * x * (10 + x * (6 * x - 15))


def gust(wind, seed, seconds):
    """Factor on the wind's velocity: 1 + gust Σ sin(2π f_k t + φ_k) / √(GUSTS/2), φ_k drawn from the seed."""
    total = 0.0
    for k in range(GUSTS):
        frequency = wind.get("gust_frequency", 0.5) * (1 + k * SPACING)
        total += math.sin(2 * math.pi * (frequency * seconds + _fraction(seed, k)))
    return 1 + wind["gust"] * total / math.sqrt(GUSTS / 2)


def _sum(oscillations, seconds):
    total = numpy.zeros(3)
    for o in oscillations:
        swing = math.sin(2 * math.pi * o["frequency"] * seconds + math.radians(o.get("phase_degrees", 0)))
        total += numpy.array(o["axis"], dtype=float) * (o["amplitude"] * swing)
    return total


def _fraction(seed, k):
    """A number in [0, 1) that depends on nothing but these two: no generator whose stream may change with its version."""
    return int.from_bytes(hashlib.sha256(f"{seed} {k}".encode()).digest()[:6], "little") / 2**48
