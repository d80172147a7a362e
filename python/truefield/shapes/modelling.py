"""The few tools from which the castings are made: lofts, turned bosses, bores, swept ducts, ribs, and the last polish.

A solid here is a `manifold3d.Manifold`: its booleans return manifolds for manifolds. Lengths are millimetres (or
inches), every profile is a list of (height along the axis, radius or offset) pairs.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from manifold3d import Error, Manifold, Mesh64, OpType

from truefield.mesh import TriangleMesh
from truefield.shapes.analytic import unit_circle

Points = npt.NDArray[np.float64]
Vector = tuple[float, float, float]
Profile = Sequence[tuple[float, float]]
Axis = Literal["+x", "-x", "+y", "-y", "+z", "-z"]

# Columns: where the local x, y and z axes go. All are rotations by right angles, hence exact.
_FRAMES: dict[str, tuple[Vector, Vector, Vector]] = {
    "+z": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    "+x": ((0, 1, 0), (0, 0, 1), (1, 0, 0)),
    "-x": ((0, -1, 0), (0, 0, 1), (-1, 0, 0)),
    "+y": ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    "-y": ((0, 0, 1), (-1, 0, 0), (0, -1, 0)),
}


def solid_of_rings(rings: npt.ArrayLike) -> Any:
    """The solid whose skin joins consecutive rings (k, n, 3) of n points each and ends in fans about their centroids.

    Rings run counter-clockwise seen against the direction in which they follow each other.
    """
    # Coarser than any rounding in sines and products, so that every machine starts from the same numbers.
    points = np.round(np.asarray(rings, dtype=np.float64) * 2.0**32) / 2.0**32
    count, n, _ = points.shape
    low, high = points[0].mean(axis=0), points[-1].mean(axis=0)
    vertices = np.vstack([points.reshape(-1, 3), low, high])
    a = np.arange(n)
    b = (a + 1) % n
    triangles = [np.stack([b, a, np.full(n, count * n)], axis=1)]
    for level in range(count - 1):
        here, there = level * n, (level + 1) * n
        triangles += [np.stack([here + a, here + b, there + b], axis=1)]
        triangles += [np.stack([here + a, there + b, there + a], axis=1)]
    top = (count - 1) * n
    triangles += [np.stack([top + a, top + b, np.full(n, count * n + 1)], axis=1)]
    return _checked(Manifold(Mesh64(vertices, np.concatenate(triangles).astype(np.uint64))))


def _checked(solid: Any) -> Any:
    if solid.status() != Error.NoError or solid.is_empty():
        raise RuntimeError(f"modelling step gave no solid: {solid.status()}")
    return solid


def union(solids: Iterable[Any]) -> Any:
    """Everything in any of the solids."""
    return _checked(Manifold.batch_boolean(list(solids), OpType.Add))


def less(solid: Any, cuts: Iterable[Any]) -> Any:
    """What is left of `solid` when all `cuts` are taken away."""
    return _checked(solid - union(cuts))


def placed(solid: Any, at: Vector, axis: Axis = "+z") -> Any:
    """The solid with its local z axis turned to `axis`, its origin moved to `at`."""
    frame = np.array(_FRAMES[axis], dtype=np.float64).T
    return solid.transform(np.column_stack([frame, np.asarray(at, dtype=np.float64)]))


def rounded_rectangle(size: tuple[float, float], radius: float, per_corner: int = 8) -> Points:
    """Corners (4 x (per_corner + 1), 2) of a rectangle about the origin with rounded corners, counter-clockwise."""
    arc = radius * unit_circle(4 * per_corner)
    x, y = 0.5 * size[0] - radius, 0.5 * size[1] - radius
    corners = []
    for quarter, centre in enumerate([(x, y), (-x, y), (-x, -y), (x, -y)]):
        indices = (np.arange(per_corner + 1) + quarter * per_corner) % (4 * per_corner)
        corners.append(arc[indices] + centre)
    return np.concatenate(corners)


def moulded(size: tuple[float, float], radius: float, profile: Profile, per_corner: int = 8) -> Any:
    """A block over a rounded rectangle; `profile` lists (z, offset of the outline): draft, fillets, rounded edges."""
    rings = []
    for z, offset in profile:
        grown = (size[0] + 2.0 * offset, size[1] + 2.0 * offset)
        outline = rounded_rectangle(grown, radius + offset, per_corner)
        rings.append(np.column_stack([outline, np.full(len(outline), z)]))
    return solid_of_rings(rings)


def turned(profile: Profile, segments: int = 32) -> Any:
    """A turned part about z; `profile` lists (z, radius) upwards."""
    circle = unit_circle(segments)
    return solid_of_rings([np.column_stack([r * circle, np.full(segments, z)]) for z, r in profile])


def rounding(z: float, reach: float, radius: float, kind: Literal["base", "top", "bottom"], steps: int = 4) -> Profile:
    """Profile of a quarter circle: "base" concave above z, "top" convex below z, "bottom" convex above z."""
    points = []
    for k in range(steps + 1):
        angle = 0.5 * math.pi * k / steps
        c, s = radius * (1.0 - math.cos(angle)), radius * (1.0 - math.sin(angle))
        if kind == "base":
            points.append((z + c, reach + s))
        elif kind == "top":
            points.append((z - s, reach - c))
        else:
            points.append((z + c, reach - s))
    return points


def boss(radius: float, height: float, fillet: float = 0.0, edge: float = 0.0, segments: int = 32) -> Any:
    """A round boss on z = 0 with a concave fillet at its foot and a rounded edge on top; its foot reaches below 0."""
    foot = [(-1.0, radius + fillet), *rounding(0.0, radius, fillet, "base")] if fillet else [(0.0, radius)]
    top = rounding(height, radius, edge, "top") if edge else [(height, radius)]
    return turned([*foot, *top], segments)


def bore(radius: float, start: float, end: float, segments: int = 32) -> Any:
    """A cylinder about z to be cut away, from `start` to `end`."""
    return turned([(start, radius), (end, radius)], segments)


def extruded(outline: Sequence[tuple[float, float]], start: float, end: float) -> Any:
    """A prism over a star-shaped outline (counter-clockwise), from z = `start` to `end`."""
    flat = np.asarray(outline, dtype=np.float64)
    return solid_of_rings([np.column_stack([flat, np.full(len(flat), z)]) for z in (start, end)])


def block(low: Vector, high: Vector) -> Any:
    """The box between two corners."""
    size = (high[0] - low[0], high[1] - low[1], high[2] - low[2])
    return _checked(Manifold.cube(size).translate(low))


def hull(points: Sequence[Vector]) -> Any:
    """The convex hull of points."""
    return _checked(Manifold.hull_points(np.asarray(points, dtype=np.float64)))


def duct(centres: npt.ArrayLike, radii: npt.ArrayLike, segments: int = 32) -> Any:
    """A round duct along a smooth line of centres (k, 3) with one radius each; its bends are wider than its radius."""
    line, width = np.asarray(centres, dtype=np.float64), np.asarray(radii, dtype=np.float64)
    tangents = np.gradient(line, axis=0)
    tangents /= np.sqrt((tangents**2).sum(axis=1, keepdims=True))
    circle = unit_circle(segments)
    side = np.eye(3)[int(np.argmin(np.abs(tangents[0])))]
    rings = []
    for centre, tangent, radius in zip(line, tangents, width, strict=True):
        side = side - tangent * float(side @ tangent)
        side = side / math.sqrt(float(side @ side))
        other = np.cross(tangent, side)
        rings.append(centre + radius * (circle[:, :1] * side + circle[:, 1:] * other))
    return solid_of_rings(rings)


def finished(solid: Any, name: str, smallest: float) -> TriangleMesh:
    """The mesh of a solid, flawless by `TriangleMesh.check`, without features below `smallest` or a fraction of it.

    Vertices lie on the lattice of the floats of single precision near the largest coordinate: an STL file gives the
    same mesh back, and last-bit differences between machines vanish.
    """
    whole = solid.as_original()
    for attempt in range(8):
        # Leaving out small features can fold a nearby sliver over its neighbour; leaving out less then helps.
        mesh = _on_lattice(_checked(whole.simplify(smallest / 2.0**attempt)), name)
        if not mesh.check().problems():
            return mesh
    raise RuntimeError(f"no mesh of {name} without flaws was found: {'; '.join(mesh.check().problems())}")


def _on_lattice(solid: Any, name: str) -> TriangleMesh:
    mesh = solid.to_mesh64()
    vertices = np.array(mesh.vert_properties[:, :3], dtype=np.float64)
    step = float(np.spacing(np.float32(np.abs(vertices).max())))
    return TriangleMesh(np.round(vertices / step) * step, np.array(mesh.tri_verts, dtype=np.int64), name=name)
