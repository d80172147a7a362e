"""The pictures of Frisken et al. 2000, of our own shapes: `python examples/gallery.py docs/adaptive.png`.

Carved slab, vase with a chiselled relief, Menger sponge, molecule and its offset, teapot of Bezier patches, letter R
as a quadtree, and one field at four levels of detail. Takes some minutes.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import truefield as tf
from PIL import Image, ImageDraw
from truefield import csg, lettering, patches, polygons

SIZE = (800, 640)
COLUMNS = 4
CLAY = (206, 172, 140)


def slab() -> Image.Image:
    """A slab carved with a ball-ended chisel along rose curves."""
    field = tf.adaptive_field(csg.rounded_box((4, 4, 0.8), 0.1), 4e-3, growth=0.2, rule="samples")
    turn = np.linspace(0, 2 * np.pi, 1201)
    for petals, radius in ((2.0, 1.75), (4.0, 1.3)):
        reach = radius * np.cos(petals * turn)
        depth = 0.42 + 0.05 * np.cos(6 * turn)
        path = np.stack([reach * np.cos(turn), reach * np.sin(turn), depth], axis=1)
        for start in range(0, len(path) - 1, 12):
            field = field.carve(csg.sphere(0.11), path=path[start : start + 13])
    return field.render(size=SIZE, colour=CLAY, samples=9)


def vase() -> Image.Image:
    """A vase of revolution, hollow, with waves carved around it."""
    outside = csg.ellipsoid((1.0, 1.0, 1.4)).blend(csg.cylinder(0.45, 3.6), 0.35)
    solid = (outside & csg.box((4, 4, 3.2))) - outside.offset(-0.18).translate((0, 0, 0.12))
    field = tf.adaptive_field(solid, 6e-3, growth=0.2, rule="samples")
    turn = np.linspace(0, 2 * np.pi, 361)
    for height in np.linspace(-0.8, 0.8, 9):
        z = height + 0.06 * np.sin(8 * turn)
        radius = np.sqrt(np.maximum(1.0 - (z / 1.4) ** 2, 0.0)) + 0.03
        path = np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)
        field = field.carve(csg.sphere(0.07), path=path)
    return field.render(size=SIZE, colour=(150, 178, 190), samples=9)


def sponge() -> Image.Image:
    """A Menger sponge of three levels."""
    return tf.adaptive_field(csg.menger_sponge(3), 2e-3, growth=np.inf, rule="samples").render(size=SIZE, samples=9)


def molecule() -> Image.Image:
    """A ring of atoms with branches, and the surface a quarter of a unit outside it."""
    turn = np.arange(6) * np.pi / 3
    ring = np.stack([np.cos(turn), np.sin(turn), np.zeros(6)], axis=1)
    centers = np.concatenate([1.3 * ring, 2.2 * ring * [1, 1, 0] + [0, 0, 0.2]])
    field = tf.adaptive_field(csg.molecule(centers, np.repeat([0.55, 0.38], 6)), 1e-3, growth=0.1, rule="samples")
    page = Image.new("RGB", SIZE, "white")
    half = (SIZE[0] // 2, SIZE[1])
    page.paste(field.render(size=half, colour=(186, 96, 92), samples=9), (0, 0))
    page.paste(field.render(size=half, distance=0.25, colour=(140, 170, 205), samples=9), (half[0], 0))
    return page


def teapot() -> Image.Image:
    """A teapot of bicubic Bezier patches."""
    return tf.adaptive_field(patches.teapot(), 5e-3, growth=np.inf, rule="samples").render(
        size=SIZE, colour=(214, 206, 188), samples=9
    )


def letter() -> Image.Image:
    """The letter R as a quadtree: cells are large along straight edges and small at corners."""
    field = tf.adaptive_field(polygons.letter_r(), 2e-3, growth=np.inf)
    low, high = field.extent
    side = SIZE[1] - 56  # the label goes below
    x, y = (np.linspace(low[axis], high[axis], side) for axis in (0, 1))
    points = np.stack(
        [*(g.ravel() for g in np.meshgrid(x, y[::-1])), np.full(side * side, 0.5 * (low[2] + high[2]))], 1
    )
    inside = (field.distance(points) < 0).reshape(side, side)
    image = Image.fromarray(np.where(inside[..., None], CLAY, 255).astype(np.uint8))
    draw = ImageDraw.Draw(image)
    leaves = field.leaves()
    scale = (side - 1) / (high[0] - low[0])
    for left, right in zip(leaves.low, leaves.high, strict=True):
        corners = [
            (left[0] - low[0]) * scale,
            (high[1] - right[1]) * scale,
            (right[0] - low[0]) * scale,
            (high[1] - left[1]) * scale,
        ]
        draw.rectangle([round(c) for c in corners], outline=(110, 120, 130))
    page = Image.new("RGB", SIZE, "white")
    page.paste(image, ((SIZE[0] - side) // 2, 0))
    return page


def levels() -> Image.Image:
    """One field at four levels of detail, by the error each cell holds."""
    shape = csg.rounded_box((2, 2, 2), 0.2) - csg.sphere(1.25) | csg.torus(0.6, 0.18)
    field = tf.adaptive_field(shape, 2e-3, growth=0.2)
    page = Image.new("RGB", (2 * SIZE[0], SIZE[1]), "white")
    half = (SIZE[0] // 2, SIZE[1])
    for place, tolerance in enumerate((0.2, 0.08, 0.02, 0.002)):
        coarse = field.level_of_detail(tolerance=tolerance)
        tile = coarse.render(size=half, samples=9)
        says = f"error {tolerance:g}, {coarse.statistics()['leaves']} leaves"
        ImageDraw.Draw(tile).text((12, SIZE[1] - 70), says, fill=(60, 66, 74), font=lettering.font(15))
        page.paste(tile, (place * half[0], 0))
    return page


PICTURES: dict[str, Callable[[], Image.Image]] = {
    "carved slab": slab,
    "carved vase": vase,
    "Menger sponge": sponge,
    "letter R, quadtree": letter,
    "molecule, and grown by 0.25": molecule,
    "teapot of patches": teapot,
    "levels of detail": levels,
}


def main(path: Path, only: list[str]) -> None:
    """Draws all pictures, or those named, on one page."""
    chosen = {name: draw for name, draw in PICTURES.items() if not only or any(word in name for word in only)}
    tiles = []
    for name, draw in chosen.items():
        start = time.perf_counter()
        tile = draw().convert("RGB")
        ImageDraw.Draw(tile).text((16, SIZE[1] - 40), name, fill=(60, 66, 74), font=lettering.font(24))
        tiles.append(tile)
        print(f"{name}: {time.perf_counter() - start:.1f} s", flush=True)
    width = min(COLUMNS * SIZE[0], sum(tile.width for tile in tiles))
    places, right, top = [], 0, 0
    for tile in tiles:
        if right + tile.width > width:
            right, top = 0, top + SIZE[1]
        places.append((right, top))
        right += tile.width
    page = Image.new("RGB", (width, top + SIZE[1]), "white")
    for tile, at in zip(tiles, places, strict=True):
        page.paste(tile, at)
    page.resize((page.width // 2, page.height // 2), Image.Resampling.LANCZOS).save(path, optimize=True)


if __name__ == "__main__":
    if len(sys.argv) < 2 or Path(sys.argv[1]).suffix != ".png":
        sys.exit("usage: python examples/gallery.py PICTURE.png [words of the pictures wanted]")
    main(Path(sys.argv[1]), sys.argv[2:])
