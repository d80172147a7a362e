"""The demonstration part: a small gearbox housing as a foundry would cast it."""

from __future__ import annotations

from typing import Any

from truefield.mesh import TriangleMesh
from truefield.shapes.modelling import (
    bore,
    boss,
    finished,
    hull,
    less,
    moulded,
    placed,
    rounding,
    union,
)

# Outline of the body at the flange and of the room inside it; both lean in by the draft.
_BODY, _BODY_RADIUS = (118.0, 70.0), 14.0
_WALL = 5.0
_AXIS = 37.0
_FLANGE_BOLTS = [(x, y) for y in (-45.5, 45.5) for x in (-66.0, -23.0, 23.0, 66.0)] + [(-71.0, 0.0), (71.0, 0.0)]
_COVER, _COVER_BOLTS = (16.0, 0.0), [(-4.0, -20.0), (-4.0, 20.0), (36.0, -20.0), (36.0, 20.0)]


def housing() -> TriangleMesh:
    """A gearbox housing of 160 x 110 x 80 millimetres, open below: about 19,000 triangles.

    Walls of 5 with draft and fillets, a flange of 8 with ten bolt bosses, a through and a blind bearing seat, gussets,
    a cover opening with screw bosses. Four places are heavier than 10, as a hurried designer leaves them: the solid
    mounting pad on the +y side where it meets a gusset (thickness 17), the solid lifting boss on the roof (11), and
    the feet of the two ribs under the bearing seats (10.8).
    """
    return finished(less(union(_skin()), [_room(), *_machining()]), "housing", smallest=0.02)


def _skin() -> list[Any]:
    draft = -2.0
    flange = moulded((160.0, 110.0), 16.0, [(0.0, -0.5), (0.5, 0.0), *rounding(8.0, 0.0, 1.5, "top")])
    roof = rounding(74.0, draft, 9.0, "top", 6)
    body = moulded(_BODY, _BODY_RADIUS, [(2.0, 5.0), *rounding(8.0, 0.0, 5.0, "base"), *roof])
    solids = [flange, body]
    solids += [placed(boss(7.5, 6.0, 1.5, 1.0), (x, y, 8.0)) for x, y in _FLANGE_BOLTS]
    solids += [placed(boss(24.0, 22.0, 4.0, 1.5, 64), (58.0, 0.0, _AXIS), "+x")]
    solids += [placed(boss(20.0, 22.0, 4.0, 1.5, 64), (-58.0, 0.0, _AXIS), "-x")]
    solids += [_gusset(x, side) for x in (-44.0, 0.0, 44.0) for side in (-1.0, 1.0)]
    solids += [_strut(side) for side in (-1.0, 1.0)]
    solids += [placed(boss(17.0, 6.5, 3.0, 1.0, 48), (*_COVER, 73.5))]
    solids += [placed(boss(5.5, 6.5, 2.0, 1.0), (x, y, 73.5)) for x, y in _COVER_BOLTS]
    solids += [placed(boss(9.0, 6.0, 4.0, 1.5, 48), (-34.0, 0.0, 74.0))]
    solids += [placed(boss(8.5, 14.0, 4.0, 1.5, 48), (0.0, 34.0, 36.0), "+y")]
    return solids


def _gusset(x: float, side: float) -> Any:
    """A rib from the flange up the long side of the body, 4.2 thick at its foot and a fifth less at its edge."""
    return hull(
        [
            (x + dx * taper, side * y, z)
            for dx in (-2.1, 2.1)
            for taper, y, z in ((1.0, 30.0, 6.0), (0.8, 48.0, 6.0), (0.8, 33.5, 58.0), (1.0, 30.0, 58.0))
        ]
    )


def _strut(side: float) -> Any:
    """The rib that carries a bearing seat on the flange."""
    return hull(
        [(side * x, y, z) for x, z in ((50.0, 5.0), (74.0, 5.0), (74.0, 24.0), (50.0, 24.0)) for y in (-3.6, 3.6)]
    )


def _room() -> Any:
    size = (_BODY[0] - 2.0 * _WALL, _BODY[1] - 2.0 * _WALL)
    roof = rounding(69.0, -2.0, 4.5, "top", 6)
    return moulded(size, _BODY_RADIUS - _WALL, [(-1.0, 0.0), (8.0, 0.0), *roof])


def _machining() -> list[Any]:
    cuts = [placed(bore(3.5, -1.0, 20.0), (x, y, 0.0)) for x, y in _FLANGE_BOLTS]
    cuts += [placed(bore(17.5, -10.0, 30.0, 64), (58.0, 0.0, _AXIS), "+x")]
    cuts += [placed(bore(14.0, -10.0, 15.0, 64), (-58.0, 0.0, _AXIS), "-x")]
    cuts += [placed(bore(12.0, -10.0, 10.0, 48), (*_COVER, 74.0))]
    cuts += [placed(bore(2.1, -3.0, 10.0, 24), (x, y, 74.0)) for x, y in _COVER_BOLTS]
    return cuts
