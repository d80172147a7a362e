"""The picture of volumes in the README: an image's transform, a slice through a part, and what grows from the part.

Run: python examples/volume_pictures.py [docs/volumes.png]
"""

import sys
from pathlib import Path

import numpy as np
import truefield as tf
from PIL import Image, ImageDraw
from truefield import pictures, slices
from truefield.lettering import FAINT, write

SIZE = (800, 640)
GROWTH = 6.0


def gear(pixels: int, teeth: int = 9) -> np.ndarray:
    """A gear with a keyed bore, (x, y) booleans."""
    angle = np.linspace(0.0, 2.0 * np.pi, 40 * teeth, endpoint=False)
    wave = np.clip(2.2 * np.cos(teeth * angle), -1.0, 1.0)
    outline = pixels * (0.5 + (0.36 + 0.06 * wave)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))
    image = Image.new("1", (pixels, pixels))
    draw = ImageDraw.Draw(image)
    draw.polygon([tuple(p) for p in outline], fill=1)
    middle, bore = pixels / 2, 0.11 * pixels
    draw.ellipse((middle - bore, middle - bore, middle + bore, middle + bore), fill=0)
    draw.rectangle((middle - 0.03 * pixels, middle - 0.15 * pixels, middle + 0.03 * pixels, middle), fill=0)
    return np.asarray(image).T


def main() -> None:
    """Draws the three and puts them beside each other."""
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/volumes.png")
    distance = tf.distance_transform(gear(1024), sampling=0.1, signed=True, surface="between")
    image = slices.transform_picture(distance, spacing=0.1, title="Transform of an image", size=SIZE)

    part = tf.shapes.housing()
    field = tf.Surface(part).sample(resolution=320, margin=2.0 * GROWTH)
    cut = slices.slice_picture(field, "y", at=6.0, title="Slice through samples of a part", size=SIZE)

    # A cover that keeps its distance all around, cut open in the middle.
    nodes = field.origin[1] + np.arange(field.shape[1]) * field.spacing[1]
    half = np.broadcast_to((nodes - 6.0)[:, None], field.shape)
    behind = tf.SampledField.from_array(half, field.origin, field.spacing, error=1e-4)
    cover = (field.offset(GROWTH) - field.offset(0.5 * GROWTH) | field) & behind
    mesh = cover.surface()
    shell = pictures.part_picture(mesh, view=(-0.8, -1.2, -0.7), size=(SIZE[0], SIZE[1] - 120))
    title = ImageDraw.Draw(page := Image.new("RGB", (3 * SIZE[0], SIZE[1]), "white"))
    write(title, (2 * SIZE[0] + 34, 34), "Marching cubes of a combined field", 34)
    write(title, (2 * SIZE[0] + 34, 79), "(part.offset(6) - part.offset(3) | part) & half", 23, colour=FAINT)

    for column, picture in enumerate((image, cut)):
        page.paste(picture, (column * SIZE[0], 0))
    page.paste(shell, (2 * SIZE[0], 120))
    path.parent.mkdir(parents=True, exist_ok=True)
    page.save(path, optimize=True)


if __name__ == "__main__":
    main()
