"""Solids to put together: `csg.box((4, 4, 1)) - csg.sphere(1.2).translate((0, 0, 0.5))`.

Every primitive answers its exact signed distance, inside and outside, with its centre in the origin unless another is
given; lengths are in model units. Shapes are joined and cut by the operators of `Shape`: the value of a union is the
least of its parts', exact outside; `Shape.bounds` says where it is only a bound.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import ArrayLike

from truefield import _truefield, arguments
from truefield.errors import TruefieldError
from truefield.fields import Surface
from truefield.mesh import TriangleMesh
from truefield.shape import (
    Axis,
    Shape,
    Solid,
    Vector,
    axis_text,
    direction,
    inner,
    numbers,
    of_field,
    of_mesh,
    unite,
    vector,
)
from truefield.shape import shape as as_shape

if TYPE_CHECKING:
    from truefield.adaptive import AdaptiveField

_ORIGIN = (0.0, 0.0, 0.0)


def sphere(radius: float, center: Vector = _ORIGIN) -> Shape:
    """The ball of `radius` around `center`."""
    r, c = arguments.length("radius", radius), vector("center", center)
    return Shape(_truefield.sphere(r, c), f"csg.sphere({r:g}{_at(c)})", ball=(np.array(c), r))


def box(size: Vector, center: Vector = _ORIGIN) -> Shape:
    """The box of edge lengths `size` along x, y and z around `center`."""
    s, c = vector("size", size), vector("center", center)
    return Shape(_truefield.cuboid(s, 0.0, c), f"csg.box({numbers(s)}{_at(c)})")


def rounded_box(size: Vector, radius: float, center: Vector = _ORIGIN) -> Shape:
    """The box of edge lengths `size`, its edges and corners rounded by `radius`, at most half its shortest edge."""
    s, r, c = vector("size", size), arguments.length("radius", radius), vector("center", center)
    return Shape(_truefield.cuboid(s, r, c), f"csg.rounded_box({numbers(s)}, {r:g}{_at(c)})")


def cylinder(radius: float, height: float, axis: Axis = "z", center: Vector = _ORIGIN) -> Shape:
    """The cylinder of `radius` and `height` around an axis: "x", "y", "z" or any direction."""
    r, h = arguments.length("radius", radius), arguments.length("height", height)
    a, c = direction("axis", axis), vector("center", center)
    return Shape(_truefield.frustum(r, r, h, a, c), f"csg.cylinder({r:g}, {h:g}{_along(axis)}{_at(c)})")


def cone(radius: float, height: float, top: float = 0.0, axis: Axis = "z", center: Vector = _ORIGIN) -> Shape:
    """The cone whose radius goes from `radius`, half the height below `center`, to `top`, half the height above it."""
    r, t = arguments.length("radius", radius, least=0.0), arguments.length("top", top, least=0.0)
    h, a, c = arguments.length("height", height), direction("axis", axis), vector("center", center)
    cut = f", top={t:g}" if t else ""
    return Shape(_truefield.frustum(r, t, h, a, c), f"csg.cone({r:g}, {h:g}{cut}{_along(axis)}{_at(c)})")


def capsule(a: Vector, b: Vector, radius: float) -> Shape:
    """All points within `radius` of the segment from `a` to `b`."""
    start, end, r = vector("a", a), vector("b", b), arguments.length("radius", radius)
    return Shape(_truefield.capsule(start, end, r), f"csg.capsule({numbers(start)}, {numbers(end)}, {r:g})")


def torus(major: float, minor: float, axis: Axis = "z", center: Vector = _ORIGIN) -> Shape:
    """All points within `minor` of the circle of radius `major` around an axis; `minor` is less than `major`."""
    big, small = arguments.length("major", major), arguments.length("minor", minor)
    a, c = direction("axis", axis), vector("center", center)
    return Shape(_truefield.torus(big, small, a, c), f"csg.torus({big:g}, {small:g}{_along(axis)}{_at(c)})")


def half_space(point: Vector, normal: Vector) -> Shape:
    """All points behind the plane through `point`, seen from where `normal` points to; it has no end."""
    p, n = vector("point", point), vector("normal", normal)
    return Shape(_truefield.half_space(p, n), f"csg.half_space({numbers(p)}, {numbers(n)})")


def ellipsoid(axes: Vector, center: Vector = _ORIGIN) -> Shape:
    """The ellipsoid with half axes `axes` along x, y and z."""
    a, c = vector("axes", axes), vector("center", center)
    return Shape(_truefield.ellipsoid(a, c), f"csg.ellipsoid({numbers(a)}{_at(c)})")


def menger_sponge(level: int, size: float = 1.0, center: Vector = _ORIGIN) -> Shape:
    """The Menger sponge: a cube of edge `size` drilled through `level` times, 0 to 16, each time a third as wide.

    Distances are exact, inside and outside.
    """
    n, s = arguments.count("level", level, least=0), arguments.length("size", size)
    c, edge = vector("center", center), "" if s == 1.0 else f", {s:g}"
    return Shape(_truefield.menger_sponge(min(n, 2**32 - 1), s, c), f"csg.menger_sponge({n}{edge}{_at(c)})")


def molecule(centers: ArrayLike, radii: ArrayLike, sharpness: float = 4.0) -> Shape:
    """Atoms that melt into each other: where the sum of Gaussians exp(-s (d^2 / r^2 - 1)) is at least 1.

    Args:
        centers: (n, 3).
        radii: one, or (n,): an atom on its own is a ball of its radius.
        sharpness: s, 0.25 to 1000; the less, the more atoms melt.

    A density is no distance: values come from it by a bound of its slope, and are at the surface some 0.4 to 1 of the
    distance; `bounds` encloses it.
    """
    points = arguments.points(centers)
    try:
        r = np.asarray(radii, dtype=np.float64)
        r = np.ascontiguousarray(np.broadcast_to(r, (len(points),)))
    except (TypeError, ValueError):
        raise TruefieldError(f"radii do not fit {len(points)} centers; give one length or one for each") from None
    s = arguments.number("sharpness", sharpness)
    return Shape(_truefield.molecule(points, r, s), f"csg.molecule(<{len(points)} atoms>)")


def mesh(part: TriangleMesh | Surface) -> Shape:
    """A triangle mesh as a shape; give a `Surface` to choose the sign rule or to share its tree."""
    if not isinstance(part, TriangleMesh | Surface):
        raise TruefieldError(f"csg.mesh takes a TriangleMesh or a Surface, not {type(part).__name__}; read it first")
    return of_mesh(part)


def field(of: AdaptiveField) -> Shape:
    """The solid of an adaptive field as a shape: as a tool, as a part of other shapes, or to sample it anew.

    Its value is what the field says, and `Shape.bounds` has the field's errors, so that what is made of it is as far
    from the truth as the field is. Outside the domain it is positive and less than the distance: give a field that is
    to be a tool a domain with room around the solid.

    Raises:
        TruefieldError: the field does not know all of its solid, which reaches beyond the domain; or it is of a mesh
            with openings, or of a polygon; or it holds no solid.
    """
    if not isinstance(getattr(of, "_native", None), _truefield.AdaptiveField):
        raise TruefieldError(f"csg.field takes an AdaptiveField, not {type(of).__name__}; make one with adaptive_field")
    return of_field(of._native)


def union(*shapes: Solid | Sequence[Solid]) -> Shape:
    """What lies in any of the shapes; thousands are fine."""
    return unite(_several("union", shapes))


def intersection(*shapes: Solid | Sequence[Solid]) -> Shape:
    """What lies in all of the shapes."""
    several = _several("intersection", shapes)
    text = "csg.intersection(" + ", ".join(inner(one) for one in several) + ")"
    return Shape(_truefield.intersection_of([one._native for one in several]), text)


def sweep(tool: Solid, path: ArrayLike) -> Shape:
    """What a tool leaves on its way along a path.

    Args:
        tool: a ball, or any convex shape that is exact: a box, a cone, a scaled capsule...; a chisel. Sweep the parts
            of others one by one.
        path: (n, 3) points, to which the origin of the tool is moved; or (n, 4, 4) poses, matrices that turn and move.
            Between them the tool moves straight and turns evenly.

    Outside, the distance is exact; inside, values bound it.

    Raises:
        TruefieldError: the path has no points, a pose does more than turn and move, or the tool is not convex.
    """
    cutter = as_shape(tool)
    try:
        way = np.ascontiguousarray(path, dtype=np.float64)
    except (TypeError, ValueError):
        raise TruefieldError("path is no array of numbers; give (n, 3) points or (n, 4, 4) poses") from None
    if way.size == 0:
        raise TruefieldError("path has no points; give at least one")
    poses = way.ndim == 3 and way.shape[1:] == (4, 4)
    if not poses:
        way = arguments.vectors(way)
    if not np.isfinite(way).all():
        raise TruefieldError("path has numbers that are not finite; all must be")
    text = f"csg.sweep({inner(cutter)}, <{len(way)} {'poses' if poses else 'points'}>)"
    if poses:
        if not np.array_equal(way[:, 3], np.broadcast_to([0.0, 0.0, 0.0, 1.0], (len(way), 4))):
            raise TruefieldError("the last row of a pose is not 0, 0, 0, 1; give matrices that turn and move")
        columns = np.ascontiguousarray(way[:, :3, :3].transpose(0, 2, 1)).reshape(-1, 3)
        return Shape(_truefield.sweep(cutter._native, np.ascontiguousarray(way[:, :3, 3]), columns), text)
    if cutter._ball is not None:
        center, radius = cutter._ball
        return Shape(_truefield.tube(way + center, radius), text)
    return Shape(_truefield.sweep(cutter._native, way, None), text)


def _several(name: str, shapes: Sequence[Solid | Sequence[Solid]]) -> list[Shape]:
    if len(shapes) == 1 and isinstance(shapes[0], list | tuple):
        shapes = shapes[0]
    if not shapes:
        raise TruefieldError(f"csg.{name} was given no shapes; give at least one")
    return [as_shape(one) for one in cast("Sequence[Solid]", shapes)]


def _at(center: Sequence[float]) -> str:
    return f", center={numbers(center)}" if any(center) else ""


def _along(axis: Axis) -> str:
    return "" if isinstance(axis, str) and axis == "z" else f", axis={axis_text(axis)}"
