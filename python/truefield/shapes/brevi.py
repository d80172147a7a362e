"""A bracket that carries a shaft: the larger of the papers' two industrial parts, made anew."""

from __future__ import annotations

from typing import Any

from truefield.mesh import TriangleMesh
from truefield.shapes.modelling import bore, finished, hull, less, moulded, placed, rounding, turned, union

_WIDTH, _DEPTH, _HEIGHT = 38.1, 34.9, 96.0
_EYE = 79.0
_FEET = [(x, y) for x in (-14.0, 14.0) for y in (-12.5, 12.5)]


def brevi() -> TriangleMesh:
    """A standing bracket of 38.1 x 34.9 x 96 inches: foot, neck with side webs, bored eye, all with rounded edges.

    1,888 triangles (paper: 1,812). The deepest place, 13.00 as in the paper, lies in the neck above its blind bore.
    Source: complete-field paper 003, table 1 and figure 10, whose model is not public.
    """
    solids = [_foot(), _neck(), _eye(), *_webs()]
    return finished(less(union(solids), _cuts()), "brevi", smallest=0.02)


def _foot() -> Any:
    edges = [*rounding(0.0, 0.0, 1.0, "bottom", 1), *rounding(20.0, 0.0, 3.0, "top", 2)]
    return moulded((_WIDTH, _DEPTH), 7.0, edges, 4)


def _neck() -> Any:
    return turned([(1.0, 13.0), (19.0, 17.2), *rounding(20.0, 13.22, 4.0, "base", 3), (_EYE, 12.0)], 32)


def _eye() -> Any:
    """A drum along y, with rounded rims, at the top."""
    edges = [*rounding(-15.0, 17.0, 2.0, "bottom", 2), *rounding(15.0, 17.0, 2.0, "top", 2)]
    return placed(turned(edges, 36), (0.0, 0.0, _EYE), "+y")


def _webs() -> list[Any]:
    section = ((8.0, 18.0), (18.0, 18.0), (18.0, 21.0), (14.0, 62.0), (8.0, 66.0))
    return [hull([(side * x, dy, z) for x, z in section for dy in (-3.0, 3.0)]) for side in (-1.0, 1.0)]


def _cuts() -> list[Any]:
    shaft = [(-20.0, 9.0), (-15.0, 9.0), (-14.0, 8.0), (14.0, 8.0), (15.0, 9.0), (20.0, 9.0)]
    bolt = [(-1.0, 2.2), (15.0, 2.2), (15.0, 3.8), (30.0, 3.8)]
    cuts = [placed(turned(shaft, 24), (0.0, 0.0, _EYE), "+y")]
    cuts += [placed(turned(bolt, 12), (x, y, 0.0)) for x, y in _FEET]
    cuts.append(turned([(-1.0, 7.0), (14.0, 7.0), (18.0, 3.0)], 16))
    # A cross bore through the neck, beside its axis.
    cuts.append(placed(bore(3.0, -30.0, 30.0, 16), (-5.0, 0.0, 52.0), "+y"))
    return cuts
