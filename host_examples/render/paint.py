"""Colours, words on pictures, and sheets of several pictures."""

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from meshes import RenderError

COLORS = {"red": "#d23b30", "blue": "#2f6fc4", "green": "#3f9e4d", "yellow": "#fbd021", "orange": "#e8833a",
          "purple": "#7b52ab", "teal": "#3b9fae", "grey": "#9a9a9a", "white": "#f0f0f0"}
VIRIDIS = ("#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725")
LIFT = 0.22
INK = (45, 48, 54)


def color(name):
    """sRGB components in 0..1 of a named colour or #rrggbb."""
    text = COLORS.get(name, name)
    try:
        if len(text) != 7 or text[0] != "#":
            raise ValueError
        return np.array([int(text[i:i + 2], 16) for i in (1, 3, 5)]) / 255.0
    except ValueError:
        raise RenderError(f"unknown colour '{name}'; known: {', '.join(COLORS)}, or #rrggbb") from None


def reflectance(srgb):
    """Linear reflectance that shows as about this colour in full light."""
    return 0.85 * np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def viridis(t):
    """The perceptual colour map of that name, t in 0..1, as sRGB; its dark end is lifted so that shading shows there."""
    table = np.array([color(code) for code in VIRIDIS])
    table += np.linspace(LIFT, 0, len(table))[:, None] * (1 - table)
    t = np.clip(t, 0.0, 1.0)
    return np.stack([np.interp(t, np.linspace(0, 1, len(table)), table[:, k]) for k in range(3)], axis=-1)


def to_image(picture):
    x = np.clip(picture, 0.0, 1.0)
    srgb = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return Image.fromarray(np.uint8(np.round(255 * srgb)))


def font(height):
    return ImageFont.load_default(size=max(9, round(height)))


def annotate(image, title, scale):
    """Draws the title in the upper left corner and, for `scale` = (caption, low, high), a colour bar in the lower left."""
    draw, unit = ImageDraw.Draw(image), image.height / 720
    if title:
        draw.text((26 * unit, 20 * unit), title, fill=INK, font=font(25 * unit))
    if scale:
        caption, low, high = scale
        width, height = round(230 * unit), max(2, round(13 * unit))
        left, top = round(26 * unit), image.height - round(50 * unit)
        bar = np.tile(viridis(np.linspace(0, 1, width)), (height, 1, 1))
        image.paste(Image.fromarray(np.uint8(np.round(255 * bar))), (left, top))
        small = font(16 * unit)
        draw.text((left, top - 5 * unit), caption, fill=INK, font=small, anchor="ls")
        draw.text((left, top + height + 4 * unit), f"{low:.3g}", fill=INK, font=small, anchor="la")
        draw.text((left + width, top + height + 4 * unit), f"{high:.3g}", fill=INK, font=small, anchor="ra")
    return image


def contact_sheet(paths, labels, columns, title, cell_width=640):
    """The pictures in rows on white, each as wide as a cell, with its label below."""
    if len(labels) != len(paths):
        raise RenderError(f"{len(labels)} labels for {len(paths)} pictures")
    cells = [open_image(path).convert("RGB") for path in paths]
    cells = [cell.resize((cell_width, round(cell.height * cell_width / cell.width)), Image.LANCZOS) for cell in cells]
    columns = min(columns or len(cells), len(cells))
    rows, gap, line = -(-len(cells) // columns), 16, 44
    head, step = (60 if title else gap), max(cell.height for cell in cells) + line
    sheet = Image.new("RGB", (columns * (cell_width + gap) + gap, head + rows * step + gap // 2), "white")
    draw = ImageDraw.Draw(sheet)
    draw.text((gap, 16), title or "", fill=INK, font=font(28))
    for i, (cell, label) in enumerate(zip(cells, labels)):
        x, y = gap + i % columns * (cell_width + gap), head + i // columns * step
        sheet.paste(cell, (x, y))
        draw.text((x + cell_width / 2, y + step - line + 9), label, fill=INK, font=font(22), anchor="ma")
    return sheet


def open_image(path):
    try:
        return Image.open(path)
    except OSError as error:
        raise RenderError(f"cannot read the picture {path}: {error}") from None
