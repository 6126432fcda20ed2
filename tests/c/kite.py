"""A kite of cloth, for tests of limp shells."""

COLUMNS, ROWS = 12, 24


def kite():
    """60 cm high and up to 40 wide, as quads, in centimetres."""
    lines = []
    for j in range(ROWS + 1):
        v = j / ROWS
        width = 40 * (0.25 + 0.75 * (1 - abs(2 * v - 1.2) / 1.2))
        lines += [f"v {(i / COLUMNS - 0.5) * width:.4f} {60 * v:.4f} 0" for i in range(COLUMNS + 1)]
    at = lambda i, j: j * (COLUMNS + 1) + i + 1
    lines += [f"f {at(i, j)} {at(i + 1, j)} {at(i + 1, j + 1)} {at(i, j + 1)}" for j in range(ROWS) for i in range(COLUMNS)]
    return "\n".join(lines) + "\n"
