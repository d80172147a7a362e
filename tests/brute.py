"""Distances and depths by brute force in plain numpy: slow, obvious, and sharing no code with the product."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from truefield.mesh import TriangleMesh

Array = NDArray[np.float64]


def distances(mesh: TriangleMesh, points: Array) -> Array:
    """(n,) unsigned distances of points to a mesh.

    The points are halved again and again; each part drops the triangles whose boxes are too far from all of its points,
    until few points are left and every remaining triangle is tried on each.
    """
    found = np.empty(len(points))
    _halve(mesh.corners, points, np.arange(len(points)), found)
    return found


def _halve(corners: Array, points: Array, chosen: NDArray[np.int64], found: Array) -> None:
    some = points[chosen]
    middle = 0.5 * (some.min(axis=0) + some.max(axis=0))
    radius = float(np.linalg.norm(some - middle, axis=1).max())
    most = float(np.linalg.norm(corners[:, 0] - middle, axis=1).min()) + 2.0 * radius
    gap = np.linalg.norm(
        np.maximum(np.maximum(corners.min(axis=1) - middle, middle - corners.max(axis=1)), 0.0), axis=1
    )
    # A millionth more, for rounding.
    near = corners[gap <= most * (1.0 + 1e-6)]
    if len(chosen) == 1 or len(chosen) * len(near) <= 10_000:
        each = to_triangles(np.repeat(some, len(near), axis=0), np.tile(near, (len(some), 1, 1)))
        found[chosen] = each.reshape(len(some), len(near)).min(axis=1)
        return
    order = chosen[np.argsort(some[:, int(np.argmax(np.ptp(some, axis=0)))], kind="stable")]
    _halve(near, points, order[: len(order) // 2], found)
    _halve(near, points, order[len(order) // 2 :], found)


def to_triangles(points: Array, corners: Array) -> Array:
    """(n,) distances of points (n, 3) to triangles (n, 3, 3) one by one: to the plane within, else to the edges."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    within = np.ones(len(points), dtype=bool)
    nearest = np.full(len(points), np.inf)
    for u, v in ((a, b), (b, c), (c, a)):
        along, offset = v - u, points - u
        within &= (np.cross(along, offset) * normal).sum(axis=1) >= 0.0
        length = (along**2).sum(axis=1)
        t = np.clip((offset * along).sum(axis=1) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(offset - t[:, None] * along, axis=1))
    size = np.linalg.norm(normal, axis=1)
    plane = np.abs(((points - a) * normal).sum(axis=1)) / np.where(size > 0.0, size, 1.0)
    return np.where(within & (size > 0.0), plane, nearest)


def interior(mesh: TriangleMesh, spacing: float) -> Array:
    """(n, 3) points of a lattice inside a closed mesh, found by counting crossings along lines parallel to z.

    The lattice is shifted by odd fractions of `spacing`, so that its lines pass beside vertices and vertical faces.
    """
    lower, upper = mesh.extent
    count = np.ceil((upper - lower) / spacing).astype(np.int64)
    shift = np.array([0.3819, 0.4142, 0.4721])
    x, y, z = (lower[k] + (np.arange(count[k]) + shift[k]) * spacing for k in range(3))
    corners = mesh.corners
    low = np.stack([np.searchsorted(axis, corners[:, :, k].min(axis=1)) for k, axis in enumerate((x, y))], axis=1)
    high = np.stack([np.searchsorted(axis, corners[:, :, k].max(axis=1)) for k, axis in enumerate((x, y))], axis=1)
    shape = high - low
    size = shape.prod(axis=1)
    t = np.repeat(np.arange(len(corners)), size)
    rank = np.arange(size.sum()) - np.repeat(np.cumsum(size) - size, size)
    i = low[t, 0] + rank // shape[t, 1]
    j = low[t, 1] + rank % shape[t, 1]
    a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
    px, py = x[i], y[j]
    area = _turn(a[:, 0], a[:, 1], b, c)
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = np.stack([_turn(px, py, b, c), _turn(px, py, c, a), _turn(px, py, a, b)]) / area
        height = weights[0] * a[:, 2] + weights[1] * b[:, 2] + weights[2] * c[:, 2]
        hit = (weights >= 0.0).all(axis=0)
    crossings = np.zeros((len(x), len(y), len(z) + 1), dtype=np.int64)
    np.add.at(crossings, (i[hit], j[hit], np.searchsorted(z, height[hit])), 1)
    inside = np.cumsum(crossings, axis=2)[:, :, :-1] % 2 == 1
    u, v, w = np.nonzero(inside)
    return np.column_stack([x[u], y[v], z[w]])


def _turn(px: Array, py: Array, u: Array, v: Array) -> Array:
    area: Array = (u[:, 0] - px) * (v[:, 1] - py) - (u[:, 1] - py) * (v[:, 0] - px)
    return area


def greatest_depth(mesh: TriangleMesh, spacing: float, starts: int = 6) -> tuple[float, Array]:
    """The greatest depth found and its place: the best of a lattice, then climbed."""
    points = interior(mesh, spacing)
    depth = distances(mesh, points)
    climbed = [climb(mesh, points[index], spacing) for index in np.argsort(-depth)[:starts]]
    return max(climbed, key=lambda found: found[0])


def climb(mesh: TriangleMesh, place: Array, step: float, shrink: float = 1e-6) -> tuple[float, Array]:
    """The greatest depth that a pattern of 26 steps, halved where none goes up, reaches from an inside place."""
    steps = np.array([(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)], dtype=np.float64)
    value, size = float(distances(mesh, place[None])[0]), step
    while size > shrink * step:
        around = place + size * steps
        tried = distances(mesh, around)
        k = int(np.argmax(tried))
        if tried[k] > value:
            place, value = around[k], float(tried[k])
        else:
            size *= 0.5
    return value, place


def winding_numbers(mesh: TriangleMesh, points: Array) -> Array:
    """(n,) generalised winding numbers: solid angles of all triangles, after van Oosterom and Strackee, summed."""
    found = np.empty(len(points))
    for k, point in enumerate(points):
        a, b, c = np.moveaxis(mesh.corners - point, 1, 0)
        x, y, z = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=1)
        rest = x * y * z + (a * b).sum(axis=1) * z + (b * c).sum(axis=1) * x + (c * a).sum(axis=1) * y
        found[k] = np.arctan2(volume, rest).sum() / (2.0 * np.pi)
    return found
