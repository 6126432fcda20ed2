"""Text files of numbers, white space between; # begins a comment."""

import math
from pathlib import Path

import numpy

from .errors import SceneError


def read_numbers(path, columns=None):
    """All numbers (k), or those of each line (k x columns)."""
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"{path}: {getattr(error, 'strerror', error)}") from None
    rows = []
    for number, line in enumerate(lines, 1):
        words = line.split("#", 1)[0].split()
        if words and columns and len(words) != columns:
            raise SceneError(f"{path}, line {number}: {len(words)} numbers, expected {columns}")
        try:
            rows.extend(map(float, words))
        except ValueError as error:
            raise SceneError(f"{path}, line {number}: {error}") from None
        if not all(map(math.isfinite, rows[-len(words):] if words else ())):
            raise SceneError(f"{path}, line {number}: a number is not finite")
    if not rows:
        raise SceneError(f"{path}: has no numbers")
    return numpy.array(rows).reshape((-1, columns) if columns else -1)
