"""The second picture of the README: a housing drawn by rays through its field, and the surface of that field grown.

Run: python examples/rays_picture.py [docs/rays.png]
"""

import sys
from pathlib import Path

import truefield as tf
from PIL import Image
from truefield import pictures

SIZE = (800, 640)
GROWN = 2.0


def main() -> None:
    """Draws both and puts them beside each other."""
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/rays.png")
    part = tf.shapes.housing()
    field = tf.adaptive_field(part, tolerance=0.02, domain=_around(part, 1.5 * GROWN))
    grown = field.surface(distance=GROWN)

    page = Image.new("RGB", (2 * SIZE[0], SIZE[1]))
    page.paste(field.render(size=SIZE), (0, 0))
    # Where grown faces meet in creases, edges follow the cells: lines along them would be ragged.
    page.paste(pictures.part_picture(grown, size=SIZE, edges=False), (SIZE[0], 0))
    path.parent.mkdir(parents=True, exist_ok=True)
    page.save(path, optimize=True)


def _around(part: tf.TriangleMesh, margin: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    low, high = part.extent
    return tuple((low - margin).tolist()), tuple((high + margin).tolist())


if __name__ == "__main__":
    main()
