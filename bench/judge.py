"""Brute force that shares nothing with any tool: distances in extended precision, sides by the winding number.

The winding number is the sum of the signed solid angles of all triangles over 4 pi (van Oosterom and Strackee 1983;
Jacobson et al. 2013); a point is inside where it is above one half.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from bench.lattice import Floats

# Rounding of the culling distances, as a fraction of the box; triangles nearer than this to the limit are kept.
MARGIN = 1e-6
# Extended precision where the machine has it, so that the judge's rounding does not count as anybody's error.
Wide = np.longdouble


class Judge:
    """Knows the truth about one mesh, slowly."""

    def __init__(self, vertices: Floats, triangles: NDArray[np.int64]) -> None:
        self.corners = vertices[triangles]
        self.columns = np.ascontiguousarray(self.corners.reshape(-1, 9).T)
        low, high = self.corners.min(axis=(0, 1)), self.corners.max(axis=(0, 1))
        self.middle, self.diagonal = (low + high) / 2, float(np.linalg.norm(high - low))
        self.centres = self.corners.mean(axis=1) - self.middle
        self.radii = np.linalg.norm(self.corners - self.middle - self.centres[:, None], axis=2).max(axis=1)

    def distance(self, points: Floats) -> Floats:
        """Unsigned distances to the nearest of all triangles, (n,)."""
        result = np.empty(len(points))
        margin = MARGIN * (self.diagonal + float(np.abs(points - self.middle).max(initial=0.0)))
        block = max(1, 2_000_000 // len(self.corners))
        for start in range(0, len(points), block):
            p = points[start : start + block]
            q = p - self.middle
            squared = (q**2).sum(1)[:, None] + (self.centres**2).sum(1) - 2 * (q @ self.centres.T)
            away = np.sqrt(np.maximum(squared, 0.0))
            # A triangle is at least its centre's distance less its radius away, and no further than its centre.
            row, triangle = np.nonzero(away - self.radii <= away.min(axis=1, keepdims=True) + 2 * margin)
            exact = _point_triangle(p[row], self.corners[triangle])
            starts = np.flatnonzero(np.r_[True, row[1:] != row[:-1]])
            result[start : start + block] = np.minimum.reduceat(exact, starts)
        return result

    def inside(self, points: Floats) -> NDArray[np.bool_]:
        """Whether each point lies inside, (n,)."""
        with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
            return np.fromiter(pool.map(self._solid_angle, points), dtype=np.float64, count=len(points)) > 2 * np.pi

    def _solid_angle(self, p: Floats) -> float:
        """The angle that all triangles fill, seen from one point: 4 pi inside a closed mesh, 0 outside."""
        ax, ay, az, bx, by, bz, cx, cy, cz = self.columns - np.tile(p, 3)[:, None]
        la = np.sqrt(ax * ax + ay * ay + az * az)
        lb = np.sqrt(bx * bx + by * by + bz * bz)
        lc = np.sqrt(cx * cx + cy * cy + cz * cz)
        up = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        down = la * lb * lc + (ax * bx + ay * by + az * bz) * lc + (bx * cx + by * cy + bz * cz) * la
        down += (cx * ax + cy * ay + cz * az) * lb
        return float(2 * np.arctan2(up, down).sum())


def _point_triangle(p: Floats, corners: Floats) -> Floats:
    """Distance of point i to triangle i: the plane where the foot is inside all three edges, else the nearest edge."""
    p, (a, b, c) = p.astype(Wide), (corners[:, k].astype(Wide) for k in range(3))
    normal = np.cross(b - a, c - a)
    area = (normal**2).sum(1)
    best = np.full(len(p), np.inf, dtype=Wide)
    within = area > 0
    for start, end in ((a, b), (b, c), (c, a)):
        edge, w = end - start, p - start
        length = (edge**2).sum(1)
        t = np.clip((w * edge).sum(1) / np.where(length > 0, length, 1), 0, 1)
        best = np.minimum(best, ((w - t[:, None] * edge) ** 2).sum(1))
        within &= (np.cross(edge, w) * normal).sum(1) >= 0
    height = ((p - a) * normal).sum(1)
    flat = height**2 / np.where(area > 0, area, 1)
    return np.sqrt(np.where(within, np.minimum(flat, best), best)).astype(np.float64)
