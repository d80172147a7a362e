"""Polygons in the plane, as shapes that are the same at every height: their adaptive fields are quadtrees.

A field of such a shape needs no more cells than the plane does: squares are divided into four, and z is never divided.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from truefield import _truefield
from truefield.errors import TruefieldError
from truefield.shape import Shape

Fill = Literal["even_odd", "winding"]


def polygon(loops: ArrayLike | Sequence[ArrayLike], fill: Fill = "even_odd") -> Shape:
    """What lies between closed loops of straight edges in the x y plane, at every z.

    Args:
        loops: a list of arrays (n, 2) of corners, each joined from the last to the first; or one such array. Model
            units.
        fill: "even_odd" is inside where the loops run around an odd number of times, so that a loop in a loop is a
            hole, whatever its direction; "winding" wherever they run around at all, so that a hole runs the other way.

    Distances are exact. Each edge is a boundary: where two loops overlap under "winding", so is the edge of one inside
    the other.

    Raises:
        TruefieldError: a loop has fewer than three corners, or corners that are no finite numbers.
    """
    try:
        one = np.ndim(np.asarray(loops[0])) == 1  # type: ignore[index]
        arrays = [np.asarray(loop, np.float64) for loop in ([loops] if one else loops)]  # type: ignore[union-attr]
    except (TypeError, ValueError, IndexError):
        raise TruefieldError("loops are not lists of corners; give arrays of shape (n, 2)") from None
    for number, corners in enumerate(arrays):
        if corners.ndim != 2 or corners.shape[1] != 2:
            raise TruefieldError(f"loop {number} has shape {corners.shape}; give an array of shape (n, 2)")
    native = _truefield.polygon([corners.tolist() for corners in arrays], fill)
    return Shape(native, f"polygon of {sum(len(corners) for corners in arrays)} corners")


def letter_r(height: float = 1.0, corners: int = 24) -> Shape:
    """The letter R, the shape of the paper's figures in a drawing of our own: a stem, a bowl with its hole, and a leg.

    Args:
        height: from the foot line to the top; the letter stands on the x axis and begins at x = 0. Model units.
        corners: of the half circles of the bowl and its hole.
    """
    turn = np.linspace(0.5 * np.pi, -0.5 * np.pi, corners + 1)

    def arc(radius: float) -> list[list[float]]:
        return [[0.36 + radius * float(np.cos(t)), 0.71 + radius * float(np.sin(t))] for t in turn]

    outline = [[0.0, 0.0], [0.0, 1.0], *arc(0.29), [0.34, 0.42], [0.64, 0.0], [0.45, 0.0], [0.17, 0.42], [0.16, 0.42]]
    hole = [[0.16, 0.58], [0.16, 0.84], *arc(0.13)]
    return polygon([height * np.array([*outline, [0.16, 0.0]]), height * np.array(hole)])
