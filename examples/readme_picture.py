"""The picture of the README: a housing by wall thickness, and the inner contour and heavy sections inside it.

Run: python examples/readme_picture.py [docs/housing.png]
"""

import sys
from pathlib import Path

import truefield as tf
from PIL import Image
from truefield import pictures

LIMIT = 10.0
DEPTH = 3.5
VIEW = (-1.0, -1.0, -1.0)
SIZE = (800, 640)


def main() -> None:
    """Draws both halves and puts them beside each other."""
    path = Path(sys.argv[1] if len(sys.argv) > 1 else "docs/housing.png")
    part = tf.shapes.housing()
    report = tf.thickness(part, tolerance=0.05, above=LIMIT, spacing=1.2)
    shell = tf.Surface(part).contour(-DEPTH, tolerance=0.1)

    chart = report.chart()
    how = {"above": LIMIT, "view": VIEW, "size": SIZE, "text": 22.0}
    edges = "beside sharp edges: the largest ball close by"
    walls = pictures.thickness_picture(part, chart.scalars["thickness"], at=chart, note=edges, **how)
    balls = [(section.point, section.depth.lower) for section in report.heavy_sections]
    heavy = pictures.heavy_sections_picture(part, balls, contour=shell, note=f"orange: all places {DEPTH} deep", **how)

    page = Image.new("RGB", (2 * SIZE[0], SIZE[1]))
    page.paste(walls, (0, 0))
    page.paste(heavy, (SIZE[0], 0))
    path.parent.mkdir(parents=True, exist_ok=True)
    page.save(path, optimize=True)


if __name__ == "__main__":
    main()
