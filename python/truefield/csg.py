"""Solids to put together: `csg.box((4, 4, 1)) - csg.sphere(1.2).translate((0, 0, 0.5))`.

Every primitive answers its exact signed distance, inside and outside; lengths are in model units.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truefield import _truefield, arguments
from truefield.errors import TruefieldError
from truefield.fields import Surface
from truefield.mesh import TriangleMesh
from truefield.shape import Shape

Vector = Sequence[float]

_ORIGIN = (0.0, 0.0, 0.0)


def sphere(radius: float, center: Vector = _ORIGIN) -> Shape:
    """The ball of `radius` around `center`."""
    r, c = arguments.length("radius", radius), _vector("center", center)
    return Shape(_truefield.sphere(r, c), f"csg.sphere({r:g}{_at('center', c)})")


def box(size: Vector, center: Vector = _ORIGIN) -> Shape:
    """The box of edge lengths `size` along x, y and z around `center`."""
    s, c = _vector("size", size), _vector("center", center)
    return Shape(_truefield.cuboid(s, 0.0, c), f"csg.box({_numbers(s)}{_at('center', c)})")


def mesh(part: TriangleMesh | Surface) -> Shape:
    """A triangle mesh as a shape; give a `Surface` to choose the sign rule or to share its tree."""
    if isinstance(part, TriangleMesh):
        part = Surface(part)
    if not isinstance(part, Surface):
        raise TruefieldError(f"csg.mesh takes a TriangleMesh or a Surface, not {type(part).__name__}; read it first")
    return Shape(_truefield.Shape.mesh(part._native), f"csg.mesh({part.mesh.name!r})")


def _vector(name: str, value: Vector) -> list[float]:
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise TruefieldError(f"{name} is {value!r}; give three finite numbers")
    return [float(number) for number in array]


def _numbers(values: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"


def _at(name: str, value: Sequence[float]) -> str:
    return f", {name}={_numbers(value)}" if any(value) else ""
