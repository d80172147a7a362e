"""The papers' four simple models and their two-ended sibling, with the papers' triangle counts and boxes.

Source: "complete distance field" papers, 003 table 1 and figures 7 and 8, 000 figure 7. The drawings give no
coordinates; these are chosen to meet the boxes, counts and depths of the table. The papers read a depth off the largest
*sample*, so theirs lies a little below the true one where a plate one inch thick allows 0.5.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from truefield.mesh import TriangleMesh
from truefield.shapes.analytic import Points, box, positive

# Notch depth at which a tooth's prongs hold a ball of radius 0.48; see `one_ended_tooth`.
_NOTCH = 1.425


def cube(size: float = 5.0) -> TriangleMesh:
    """The papers' cube: 12 triangles, edge 5, one corner at the origin, greatest depth size / 2 = 2.5."""
    return box(size, name="cube")


def tetrahedron(size: float = 1.0) -> TriangleMesh:
    """The papers' tetrahedron: 4 triangles, the corner of a cube with edge `size`, at the origin.

    Greatest depth size / (3 + sqrt(3)) = 0.2113 (paper: 0.2); volume size^3 / 6.
    """
    positive("size", (size,))
    vertices = size * np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=np.float64)
    return TriangleMesh(vertices, np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]), name="tetrahedron")


def one_ended_tooth() -> TriangleMesh:
    """The papers' one-ended tooth: a 2 x 2 square with a deep V notch in one side, 1 thick along x. 16 triangles.

    Box (1, 2, 2). The largest ball touches back, flank and notch of one prong: its radius, 2 / (1 + a + hypot(a, 1))
    with notch depth a = 1.425, is 0.4801 (paper: 0.48). Volume 4 - a = 2.575.
    """
    outline = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (1.0, 2.0 - _NOTCH), (0.0, 2.0)]
    # The bottom corners and the notch share each triangle, so both caps are seen to be the same mirror image.
    caps = [(3, 4, 0), (3, 0, 1), (3, 1, 2)]
    return _prism(np.array(outline), caps, "one-ended tooth")


def two_ended_tooth() -> TriangleMesh:
    """The two-ended tooth of the earlier paper: notches of the same shape in two opposite sides. 20 triangles.

    Box (1, 2, 3.85); between the notches stays a waist of length 1. The largest balls, of radius 0.5, sit in the middle
    of the plate beside the waist.
    """
    length = 2.0 * _NOTCH + 1.0
    outline = [(0.0, 0.0), (1.0, _NOTCH), (2.0, 0.0), (2.0, length), (1.0, length - _NOTCH), (0.0, length)]
    caps = [(0, 1, 5), (1, 4, 5), (1, 2, 3), (1, 3, 4)]
    return _prism(np.array(outline), caps, "two-ended tooth")


def six_pointed_star() -> TriangleMesh:
    """The papers' six-pointed star: a hexagram 1 thick along x, each cap a fan about its centre. 48 triangles.

    Box (1, 3, 2 sqrt(3)) = (1, 3, 3.4641) (paper: 3.46). Inner corners lie 1 from the centre, so the plate's thickness
    limits the ball: greatest depth 0.5 (paper: 0.49). Volume 3 sqrt(3).
    """
    half = 0.5 * math.sqrt(3.0)
    tip, notch = 2.0 * half, 1.0
    # Corner directions 90 deg + 30 deg k: tips and notches in turn; exact halves keep the outline symmetric.
    directions = [(0.0, 1.0), (-0.5, half), (-half, 0.5), (-1.0, 0.0), (-half, -0.5), (-0.5, -half)]
    directions += [(-y, -z) for y, z in directions]
    outline = [((notch if k % 2 else tip) * y, (notch if k % 2 else tip) * z) for k, (y, z) in enumerate(directions)]
    centred = np.array([*outline, (0.0, 0.0)])
    centred -= centred.min(axis=0)
    return _prism(centred, [(12, k, (k + 1) % 12) for k in range(12)], "six-pointed star", rim=12)


def _prism(outline: Points, caps: Sequence[tuple[int, int, int]], name: str, rim: int | None = None) -> TriangleMesh:
    """The prism of thickness 1 along x over `outline` (n, 2) in the y-z plane; its first `rim` points are its rim."""
    n = len(outline)
    rim = n if rim is None else rim
    vertices = np.vstack([np.column_stack([np.full(n, x), outline]) for x in (0.0, 1.0)])
    front = [(a + n, b + n, c + n) for a, b, c in caps]
    back = [(a, c, b) for a, b, c in caps]
    sides = []
    for a in range(rim):
        b = (a + 1) % rim
        sides += [(a, b, b + n), (a, b + n, a + n)]
    return TriangleMesh(vertices, np.array(back + front + sides), name=name)
