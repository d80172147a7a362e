"""What a field says of the surface nearest to points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truefield.arguments import Floats


@dataclass(frozen=True, slots=True)
class Nearest:
    """Nearest points of a surface, one row for each point asked.

    Attributes:
        distance: (n,) float64 signed distance, model units, negative inside.
        point: (n, 3) float64 nearest point of the surface.
        triangle: (n,) int64 triangle that holds it; the lowest index where several tie; -1 where the field knows none.
        feature: (n,) uint8 where on the triangle it lies: 0 face, 1 to 3 edge, 4 to 6 vertex: the papers'
            cases C1, C2, C3.
        normal: (n, 3) float64 unit gradient of the signed distance: the face normal in case C1, the direction from the
            nearest point in cases C2 and C3, turned outward.
    """

    distance: Floats
    point: Floats
    triangle: NDArray[np.int64]
    feature: NDArray[np.uint8]
    normal: Floats
