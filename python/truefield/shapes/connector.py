"""A plug connector: the smaller of the papers' two industrial parts, made anew."""

from __future__ import annotations

from typing import Any

from truefield.mesh import TriangleMesh
from truefield.shapes.modelling import block, extruded, finished, less, placed, union

# Where the pins stand, across and up; and the core they are set in, along the plug.
_PINS = [(y, z + dz) for z in (0.875, 2.025) for y, dz in ((0.7, -0.2), (1.0, 0.2), (1.3, -0.2))]
_FRONT, _BACK = 3.0, 3.98


def connector() -> TriangleMesh:
    """A plug of 6.9 x 2.0 x 2.9 inches: two sockets with pins, the core they are set in, a flange, ribs, terminals.

    328 triangles (paper: 327, odd, which no closed mesh can have). The deepest place, 0.5015 (paper: 0.50), lies in the
    core between the sockets.
    Source: complete-field paper 003, table 1 and figure 9, whose model is not public.
    """
    shell = union([block((0.0, 0.25, 0.25), (_BACK, 1.75, 2.65)), _flange(), *_ribs()])
    plug = union([less(shell, _sockets()), *_pins(), *_terminals()])
    return finished(plug, "connector", smallest=1e-4)


def _flange() -> Any:
    outline = [(0.0, 0.3), (0.3, 0.0), (1.7, 0.0), (2.0, 0.3), (2.0, 2.6), (1.7, 2.9), (0.0, 2.9)]
    return placed(extruded(outline, 0.0, 0.3), (3.4, 0.0, 0.0), "+x")


def _ribs() -> list[Any]:
    """Two that guide the plug on one side and a broad one on the other, so that it fits in one way only."""
    narrow = [block((0.4, 1.6, z - 0.1), (3.5, 1.9, z + 0.1)) for z in (0.8, 2.1)]
    return [*narrow, block((0.4, 0.1, 1.25), (3.5, 0.4, 1.65))]


def _sockets() -> list[Any]:
    return [block((-0.1, 0.45, low), (_FRONT, 1.55, high)) for low, high in ((0.45, 1.3), (1.6, 2.45))]


def _pins() -> list[Any]:
    """Contacts in the sockets."""
    return [block((0.6, y - 0.07, z - 0.07), (_FRONT + 0.2, y + 0.07, z + 0.07)) for y, z in _PINS]


def _terminals() -> list[Any]:
    """What the wires are soldered to, behind the core: flat tags."""
    return [block((_BACK - 0.2, y - 0.06, z - 0.12), (6.9, y + 0.06, z + 0.12)) for y, z in _PINS]
