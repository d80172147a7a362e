"""The largest balls around points: what fits in where no ball touches two opposing walls."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]

# A ball in a square corner of three walls leaves the corner this far off, in radii.
_CORNER: Final = math.sqrt(3.0) - 1.0
_ALIKE: Final = 0.05
_PAIRS: Final = 2_000_000


def largest_around(points: _Floats, normals: _Floats, centers: _Floats, radii: _Floats) -> _Floats:
    """(n,) diameter of the largest ball close to each point of a surface and on its inner side; 0 where none is.

    Close is what the corner of a cube is to the ball that touches its three walls: 0.73 radii off the ball. In plates
    with square edges, all places then have the plate's thickness.

    Args:
        points: (n, 3) on the surface.
        normals: (n, 3) outward, of any length.
        centers: (m, 3) of the balls.
        radii: (m,) of the balls; those that are not above zero are left out.

    The largest balls first, sorted into lattices as wide as they reach; of balls that are nearly the same, a
    twentieth of their size apart, the largest stands for all.
    """
    best = np.zeros(len(points))
    usable = np.flatnonzero(radii > 0.0)
    usable = usable[np.argsort(-radii[usable], kind="stable")]
    levels = np.frexp(radii[usable])[1]
    for level in np.unique(levels)[::-1]:
        # Points that have a ball of a higher level already find none larger.
        open_points = np.flatnonzero(best == 0.0)
        if not len(open_points):
            break
        balls = usable[levels == level]
        cells = np.floor(centers[balls] / (_ALIKE * 2.0**level))
        balls = balls[np.unique(cells, axis=0, return_index=True)[1]]
        reach = (1.0 + _CORNER) * radii[balls]
        for ball, point in _pairs(points[open_points], centers[balls], float(reach.max())):
            at = open_points[point]
            way = points[at] - centers[balls[ball]]
            close = np.einsum("ij,ij->i", way, way) <= reach[ball] ** 2
            close &= np.einsum("ij,ij->i", way, normals[at]) > 0.0
            np.maximum.at(best, at[close], 2.0 * radii[balls[ball[close]]])
    return best


def _pairs(points: _Floats, centers: _Floats, cell: float) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Indices of centres and points in cells that touch, a few million at a time; no closer pair is left out."""
    low = np.minimum(points.min(axis=0), centers.min(axis=0))
    place, home = (np.floor((where - low) / cell).astype(np.int64) + 1 for where in (points, centers))
    strides = np.array([1, 0, 0])
    sides = np.maximum(place.max(axis=0), home.max(axis=0)) + 2
    strides[1], strides[2] = sides[0], sides[0] * sides[1]
    keys = place @ strides
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    for shift in product((-1, 0, 1), repeat=3):
        wanted = home @ strides + int(np.dot(shift, strides))
        first = np.searchsorted(keys, wanted, "left")
        counts = np.searchsorted(keys, wanted, "right") - first
        ends = np.cumsum(counts)
        start = 0
        while start < len(counts):
            done = int(ends[start - 1]) if start else 0
            stop = max(start + 1, int(np.searchsorted(ends, done + _PAIRS, "right")))
            some = counts[start:stop]
            ball = np.repeat(np.arange(start, stop), some)
            within = np.arange(len(ball)) - np.repeat(np.cumsum(some) - some, some)
            yield ball, order[np.repeat(first[start:stop], some) + within]
            start = stop
