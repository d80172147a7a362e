"""Solids whose volume, distance and greatest depth are known by formula: the yardsticks of the tests.

Every solid is a closed, outward oriented manifold. Curved ones are inscribed: their vertices lie on the true surface,
their flat triangles inside it, so greatest depths are slightly below those of the smooth solid. Corner coordinates are
rounded to multiples of 2**-40 of a unit, which makes them the same on every machine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from truefield.errors import TruefieldError
from truefield.mesh import TriangleMesh

Points = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]

_BOX_TRIANGLES = (
    *((0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7)),
    *((0, 1, 5), (0, 5, 4), (1, 2, 6), (1, 6, 5)),
    *((2, 3, 7), (2, 7, 6), (3, 0, 4), (3, 4, 7)),
)


def unit_circle(segments: int) -> Points:
    """Corners (segments, 2) of a regular polygon on the unit circle, counter-clockwise from (1, 0).

    Each coordinate is a multiple of 2**-40 and quadrants mirror each other exactly where `segments` allows it.
    """
    if segments < 3:
        raise TruefieldError(f"a circle needs at least 3 segments, not {segments}: ask for more.")
    corners = np.empty((segments, 2))
    for i in range(segments):
        quarter, rest = divmod(4 * i, segments)
        angle = 0.5 * math.pi * rest / segments
        # The second half of a quarter takes its values from the first, so that mirror images agree to the bit.
        if 2 * rest > segments:
            angle = 0.5 * math.pi * (segments - rest) / segments
            x, y = math.sin(angle), math.cos(angle)
        else:
            x, y = math.cos(angle), math.sin(angle)
        for _ in range(quarter):
            x, y = -y, x
        corners[i] = x, y
    return np.round(corners * 2.0**40) / 2.0**40


def positive(name: str, values: Sequence[float]) -> None:
    """Refuses lengths that are not above zero and finite."""
    if not all(math.isfinite(value) and value > 0.0 for value in values):
        raise TruefieldError(f"{name} must be positive and finite, not {tuple(values)}: give lengths above zero.")


def _triple(size: float | Sequence[float]) -> tuple[float, float, float]:
    values = (size, size, size) if isinstance(size, int | float) else tuple(size)
    if len(values) != 3:
        raise TruefieldError(f"size must be one number or three, not {len(values)}: give (x, y, z).")
    positive("size", values)
    return float(values[0]), float(values[1]), float(values[2])


def box(size: float | Sequence[float] = (1.0, 1.0, 1.0), *, name: str = "box") -> TriangleMesh:
    """A box with one corner at the origin and edges `size` (one number, or x, y, z). 12 triangles.

    Volume x y z; greatest depth half the shortest edge.
    """
    x, y, z = _triple(size)
    base = [(0.0, 0.0), (x, 0.0), (x, y), (0.0, y)]
    vertices = [(a, b, 0.0) for a, b in base] + [(a, b, z) for a, b in base]
    return TriangleMesh(np.array(vertices), np.array(_BOX_TRIANGLES), name=name)


def plate(size: Sequence[float] = (100.0, 60.0), thickness: float = 5.0) -> TriangleMesh:
    """A flat plate, `size` (x, y) wide and `thickness` high, with one corner at the origin. 12 triangles.

    Its wall thickness is `thickness` everywhere beyond the reach of the rim; greatest depth half of it.
    """
    if len(size) != 2:
        raise TruefieldError(f"size must be two numbers, not {len(size)}: give (x, y).")
    return box((size[0], size[1], thickness), name="plate")


def wedge(size: Sequence[float] = (4.0, 2.0, 1.0)) -> TriangleMesh:
    """A wedge: right triangle (0, 0), (x, 0), (0, z) in the x-z plane, extruded along y. 8 triangles.

    Volume x y z / 2; greatest depth min(y / 2, x z / (x + z + hypot(x, z))): a ball between ends, or in the triangle.
    Thickness falls to nothing along the sharp edge, which tests how wall thickness treats such edges.
    """
    x, y, z = _triple(size)
    profile = np.array([(0.0, 0.0), (x, 0.0), (0.0, z)])
    front = np.column_stack([profile[:, 0], np.zeros(3), profile[:, 1]])
    vertices = np.vstack([front, front + np.array((0.0, y, 0.0))])
    triangles = [(0, 1, 2), (3, 5, 4), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)]
    return TriangleMesh(vertices, np.array(triangles), name="wedge")


def cylinder(radius: float = 1.0, height: float = 2.0, segments: int = 64) -> TriangleMesh:
    """A regular prism inscribed in a cylinder along z, its base centred at the origin. 4 x segments triangles.

    Volume segments / 2 x radius^2 sin(2 pi / segments) x height; greatest depth
    min(height / 2, radius cos(pi / segments)).
    """
    positive("radius and height", (radius, height))
    ring = radius * unit_circle(segments)
    low = np.column_stack([ring, np.zeros(segments)])
    vertices = np.vstack([low, low + np.array((0.0, 0.0, height)), [(0.0, 0.0, 0.0), (0.0, 0.0, height)]])
    a = np.arange(segments)
    b = (a + 1) % segments
    bottom, top = np.full(segments, 2 * segments), np.full(segments, 2 * segments + 1)
    triangles = np.concatenate(
        [
            np.stack([a, b, b + segments], axis=1),
            np.stack([a, b + segments, a + segments], axis=1),
            np.stack([b, a, bottom], axis=1),
            np.stack([a + segments, b + segments, top], axis=1),
        ]
    )
    return TriangleMesh(vertices, triangles, name="cylinder")


def torus(ring_radius: float = 3.0, tube_radius: float = 1.0, segments: tuple[int, int] = (96, 48)) -> TriangleMesh:
    """A torus about z, inscribed; `segments` (around the axis, around the tube). 2 x product of segments triangles.

    Smooth volume 2 pi^2 ring_radius tube_radius^2; greatest depth close to tube_radius, all along the ring.
    """
    positive("ring_radius and tube_radius", (ring_radius, tube_radius))
    if tube_radius >= ring_radius:
        raise TruefieldError(
            f"a torus of tube_radius {tube_radius} meets itself at ring_radius {ring_radius}: make the tube thinner."
        )
    around, across = segments
    direction, profile = unit_circle(around), unit_circle(across)
    reach = ring_radius + tube_radius * profile[:, 0]
    vertices = np.empty((around, across, 3))
    vertices[..., :2] = direction[:, None, :] * reach[None, :, None]
    vertices[..., 2] = tube_radius * profile[:, 1]
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(around), np.arange(across), indexing="ij"))
    k, m = (i + 1) % around, (j + 1) % across
    a, b, c, d = i * across + j, k * across + j, k * across + m, i * across + m
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return TriangleMesh(vertices.reshape(-1, 3), triangles, name="torus")


def sphere(radius: float = 1.0, subdivisions: int = 4) -> TriangleMesh:
    """A sphere about the origin: an octahedron whose triangles are split in four `subdivisions` times, and blown up.

    8 x 4**subdivisions triangles (4: 2,048; 8: 524,288). Greatest depth, at the centre, is the smallest distance of a
    triangle's plane from it: radius (1 - O(4**-subdivisions)).
    """
    positive("radius", (radius,))
    if not 0 <= subdivisions <= 10:
        raise TruefieldError(
            f"subdivisions must lie in 0..10, not {subdivisions}: 10 already makes 8 million triangles."
        )
    vertices = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], dtype=np.float64)
    triangles = np.array([(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])
    for _ in range(subdivisions):
        vertices, triangles = _split(vertices, triangles)
        vertices /= np.sqrt(vertices[:, :1] ** 2 + vertices[:, 1:2] ** 2 + vertices[:, 2:] ** 2)
    return TriangleMesh(radius * vertices, triangles, name="sphere")


def _split(vertices: Points, triangles: Indices) -> tuple[Points, Indices]:
    """Each triangle in four, at the midpoints of its edges."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middle = 0.5 * (vertices[unique[:, 0]] + vertices[unique[:, 1]])
    ab, bc, ca = (inverse.reshape(-1, 3) + len(vertices)).T
    a, b, c = triangles.T
    corners = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.vstack([vertices, middle]), np.concatenate([np.stack(corner, axis=1) for corner in corners])
