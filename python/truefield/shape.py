"""Shapes: anything that can be asked its distance and that fields can be built from."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from truefield import _truefield, arguments
from truefield.arguments import Floats, Progress


class Shape:
    """A solid that answers distances; immutable. `truefield.csg` and `truefield.implicit` make them."""

    __slots__ = ("_native", "_text")

    def __init__(self, native: _truefield.Shape, text: str) -> None:
        """For makers of shapes: the compiled shape, and the expression that `repr` shows."""
        self._native = native
        self._text = text

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
        """Lower and upper bounds, (n,) float64 each, of the true signed distances; equal where they are exact."""
        return self._native.bounds(arguments.points(points), threads, progress)

    def gradient(self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None) -> Floats:
        """(n, 3) float64 gradients of `distance`, outward; on a ridge that of one of its sides, or between them."""
        return self._native.gradient(arguments.points(points), threads, progress)

    def __repr__(self) -> str:
        """The expression that made the shape."""
        return self._text
