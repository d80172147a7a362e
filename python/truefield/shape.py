"""Shapes: anything that can be asked its distance and that fields can be built from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, NoReturn, Union

import numpy as np
from numpy.typing import ArrayLike

from truefield import _truefield, arguments
from truefield.arguments import Floats, Progress
from truefield.errors import TruefieldError
from truefield.fields import Surface
from truefield.immutable import Immutable
from truefield.mesh import TriangleMesh

if TYPE_CHECKING:
    from truefield.adaptive import AdaptiveField

Vector = Sequence[float] | Floats
Axis = Literal["x", "y", "z"] | Sequence[float] | Floats
Blend = Literal["circular", "polynomial"]
Solid = Union["Shape", Surface, TriangleMesh, "AdaptiveField"]

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_MOST_WRITTEN = 6


class Shape(Immutable):
    """A solid that answers distances; immutable. `truefield.csg` and `truefield.implicit` make them.

    `a | b` and `a + b` are the union, `a & b` the intersection, `a - b` the difference, `~a` and `-a` all that is
    not in a. A TriangleMesh or a Surface may stand for either, as `csg.mesh` makes a shape of it, and an
    AdaptiveField, as `csg.field` does.
    """

    __slots__ = ("_ball", "_cuts", "_native", "_parts", "_sum", "_text")

    def __init__(
        self, native: _truefield.Shape, text: str, *, ball: tuple[Floats, float] | None = None, sum: bool = False
    ) -> None:
        """For makers of shapes.

        Args:
            native: the compiled shape.
            text: the expression that `repr` shows.
            ball: centre and radius, if the shape is a ball.
            sum: the text is a sum or the like: what binds closer puts it in brackets.
        """
        self._native = native
        self._text = f"({text})" if sum else text
        self._sum = sum
        self._ball = ball
        self._parts: tuple[Shape, ...] = (self,)
        self._cuts: tuple[Shape, tuple[Shape, ...]] = (self, ())

    def __reduce__(self) -> NoReturn:
        """Refuses to be pickled."""
        raise TypeError("a shape cannot be pickled, as it may hold functions; pickle or save an adaptive field of it")

    @property
    def extent(self) -> tuple[Floats, Floats] | None:
        """The lower and upper corner, each (3,), of a box that holds the solid; None where it has no end."""
        extent = self._native.extent
        return None if extent is None else (np.array(extent[0]), np.array(extent[1]))

    def distance(self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None) -> Floats:
        """(n,) float64 values: signed distances, negative inside, wherever `bounds` are equal.

        Elsewhere, as inside a union whose parts overlap, a value has the sign of the distance, is never farther
        from zero than it, and changes by no more than one moves; `bounds` says where the distance itself is.

        Raises:
            TruefieldError: the points are not (n, 3) finite numbers.
        """
        return self._native.distance(arguments.points(points), threads, progress)

    def bounds(
        self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None
    ) -> tuple[Floats, Floats]:
        """Lower and upper bounds, (n,) float64 each, of the true signed distances; equal where they are exact.

        Where they are not, one is the value and the other comes from a search for the nearest point on the other side,
        which takes hundreds of values.
        """
        return self._native.bounds(arguments.points(points), threads, progress)

    def gradient(self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None) -> Floats:
        """(n, 3) float64 gradients of `distance`, outward; on a ridge that of one of its sides, or between them."""
        return self._native.gradient(arguments.points(points), threads, progress)

    def translate(self, by: Vector) -> Shape:
        """The shape moved by a vector."""
        shift = vector("by", by)
        ball = None if self._ball is None else (self._ball[0] + shift, self._ball[1])
        return Shape(self._native.translate(shift), f"{self._text}.translate({numbers(shift)})", ball=ball)

    def rotate(self, axis: Axis, degrees: float) -> Shape:
        """The shape turned about an axis through the origin, counter-clockwise seen from where it points to.

        Args:
            axis: "x", "y", "z" or any direction.
            degrees: the angle.
        """
        along, angle = direction("axis", axis), arguments.number("degrees", degrees)
        return Shape(self._native.rotate(along, angle), f"{self._text}.rotate({axis_text(axis)}, {angle:g})")

    def scale(self, factor: float) -> Shape:
        """The shape scaled about the origin by a positive factor, the same along all axes, as distances need it."""
        k = arguments.number("factor", factor)
        native = self._native.scale(k)
        ball = None if self._ball is None else (self._ball[0] * k, self._ball[1] * k)
        return Shape(native, f"{self._text}.scale({k:g})", ball=ball)

    def offset(self, distance: float) -> Shape:
        """All points within a distance of the shape; with a negative one, all points so deep in it.

        That is, where `distance` is at most the offset: where values are only bounds, of the distances to come too.
        """
        d = arguments.number("distance", distance)
        return Shape(self._native.offset(d), f"{self._text}.offset({d:g})")

    def shell(self, thickness: float) -> Shape:
        """The wall of the shape: what is in it, no deeper than `thickness`."""
        t = arguments.length("thickness", thickness)
        return Shape(self._native.shell(t), f"{self._text}.shell({t:g})")

    def blend(self, other: Solid, radius: float, kind: Blend = "circular") -> Shape:
        """The union with another shape, its edge filled where both are within `radius` of equally far.

        Args:
            other: the other shape.
            radius: how far the filling reaches, in model units.
            kind: "circular" fills with an arc, of `radius` where the shapes meet at right angles; "polynomial" with a
                parabola, which fills less.
        """
        second, r = shape(other), arguments.length("radius", radius)
        how = "" if kind == "circular" else f", {kind!r}"
        return Shape(self._native.blend(second._native, r, kind), f"{self._text}.blend({inner(second)}, {r:g}{how})")

    def __or__(self, other: object) -> Shape:
        """The union."""
        return NotImplemented if _other(other) is None else unite((self, shape(other)))

    def __and__(self, other: object) -> Shape:
        """The intersection."""
        second = _other(other)
        if second is None:
            return NotImplemented
        return Shape(
            _truefield.intersection_of([self._native, second._native]), f"{self._text} & {second._text}", sum=True
        )

    def __sub__(self, other: object) -> Shape:
        """The difference."""
        second = _other(other)
        if second is None:
            return NotImplemented
        # One cut after the other is one difference with many cuts, which is quick.
        whole, cuts = self._cuts[0], (*self._cuts[1], second)
        native = _truefield.difference_of(whole._native, [cut._native for cut in cuts])
        result = Shape(native, _written(f"{whole._text} - ", " - ", cuts), sum=True)
        result._cuts = (whole, cuts)
        return result

    def __invert__(self) -> Shape:
        """All that is not in the shape."""
        return Shape(self._native.complement(), f"~{self._text}", sum=True)

    def __ror__(self, other: object) -> Shape:
        """The union."""
        return self.__or__(other)

    def __rand__(self, other: object) -> Shape:
        """The intersection."""
        second = _other(other)
        return NotImplemented if second is None else second & self

    def __rsub__(self, other: object) -> Shape:
        """The difference."""
        second = _other(other)
        return NotImplemented if second is None else second - self

    __add__ = __or__
    __radd__ = __ror__
    __neg__ = __invert__

    def __repr__(self) -> str:
        """The expression that made the shape."""
        return inner(self)


def unite(shapes: Sequence[Shape]) -> Shape:
    """The union of shapes; unions among them are taken apart, so that one by one is as quick as all at once."""
    parts = tuple(part for one in shapes for part in one._parts)
    if len(parts) == 1:
        return parts[0]
    result = Shape(_truefield.union_of([part._native for part in parts]), _written("", " | ", parts), sum=True)
    result._parts = parts
    return result


def shape(given: object) -> Shape:
    """A Shape as it is; a mesh, a Surface or an AdaptiveField made one."""
    made = _other(given)
    if made is None:
        raise TruefieldError(
            f"a shape is needed, not {type(given).__name__}; csg and implicit make shapes, csg.mesh makes one of a "
            "mesh, csg.field of a field"
        )
    return made


def of_mesh(part: TriangleMesh | Surface) -> Shape:
    """A mesh as a shape."""
    surface = Surface(part) if isinstance(part, TriangleMesh) else part
    return Shape(_truefield.Shape.mesh(surface._native), f"csg.mesh({surface.mesh.name!r})")


def of_field(native: _truefield.AdaptiveField) -> Shape:
    """The solid of a compiled adaptive field as a shape."""
    return Shape(_truefield.Shape.field(native), "csg.field(<adaptive field>)")


def vector(name: str, value: Vector) -> list[float]:
    """Three finite numbers."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise TruefieldError(f"{name} is {value!r}; give three finite numbers")
    return [float(number) for number in array]


def direction(name: str, axis: Axis) -> list[float]:
    """The direction that a letter or a vector names."""
    if isinstance(axis, str):
        if axis not in _AXES:
            raise TruefieldError(f'{name} is {axis!r}; give "x", "y", "z" or a direction of three numbers')
        return list(_AXES[axis])
    return vector(name, axis)


def numbers(values: Sequence[float]) -> str:
    """Numbers as a tuple is written."""
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"


def axis_text(axis: Axis) -> str:
    """An axis as it was given."""
    return repr(axis) if isinstance(axis, str) else numbers(vector("axis", axis))


def inner(of: Shape) -> str:
    """The expression of a shape without brackets around it."""
    return of._text[1:-1] if of._sum else of._text


def _other(given: object) -> Shape | None:
    if isinstance(given, TriangleMesh | Surface):
        return of_mesh(given)
    # Fields are made of shapes: their module cannot be known here.
    native = getattr(given, "_native", None)
    if isinstance(native, _truefield.AdaptiveField):
        return of_field(native)
    return given if isinstance(given, Shape) else None


def _written(start: str, between: str, shapes: Sequence[Shape]) -> str:
    if len(shapes) > _MOST_WRITTEN:
        return f"{start}{shapes[0]._text}{between}... ({len(shapes)} shapes)"
    return start + between.join(one._text for one in shapes)
