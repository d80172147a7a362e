"""Shapes to try things on: solids with known truth, the papers' models, and castings made on the spot.

Every function returns a closed, consistently outward oriented `TriangleMesh`; `names` and `make` reach them by name.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, Final

from truefield.errors import TruefieldError
from truefield.mesh import TriangleMesh
from truefield.shapes.analytic import box, cylinder, plate, sphere, torus, wedge
from truefield.shapes.brevi import brevi
from truefield.shapes.connector import connector
from truefield.shapes.cylinder_head import cylinder_head
from truefield.shapes.housing import housing
from truefield.shapes.simple import cube, one_ended_tooth, six_pointed_star, tetrahedron, two_ended_tooth

__all__ = [
    "box",
    "brevi",
    "connector",
    "cube",
    "cylinder",
    "cylinder_head",
    "housing",
    "make",
    "names",
    "one_ended_tooth",
    "plate",
    "six_pointed_star",
    "sphere",
    "tetrahedron",
    "torus",
    "two_ended_tooth",
    "wedge",
]

_MAKERS: Final[dict[str, Callable[..., TriangleMesh]]] = {
    maker.__name__: maker
    for maker in (
        *(box, plate, wedge, cylinder, torus, sphere),
        *(cube, tetrahedron, one_ended_tooth, two_ended_tooth, six_pointed_star),
        *(connector, brevi, housing, cylinder_head),
    )
}


def names() -> tuple[str, ...]:
    """The names `make` knows: analytic solids first, then the papers' models, then castings."""
    return tuple(_MAKERS)


def make(name: str, **options: Any) -> TriangleMesh:
    """The shape called `name`, made with the options of the function of that name.

    Raises:
        TruefieldError: no shape has that name, or the shape does not take these options.
    """
    if name not in _MAKERS:
        raise TruefieldError(f"there is no shape called {name!r}; choose one of {', '.join(_MAKERS)}")
    try:
        inspect.signature(_MAKERS[name]).bind(**options)
    except TypeError as error:
        raise TruefieldError(
            f"the shape {name!r} cannot be made so: {error}; see help(truefield.shapes.{name})"
        ) from None
    return _MAKERS[name](**options)
