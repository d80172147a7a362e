"""Which points nearly coincide."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from truefield._truefield import Distinct


def leaders(points: NDArray[np.float64], within: float) -> NDArray[np.int64]:
    """For each point (n, 3) the lowest index of its group: points joined by a chain of steps of at most `within`.

    Returns (n,) int64. A step is Euclidean, in model units. O(n log n + n k), where k is how many points share a cube
    of twice `within`.
    """
    leader = _equal(points)
    unique = np.flatnonzero(leader == np.arange(len(points)))
    if within > 0.0 and len(unique) > 1:
        ends = _near(points[unique], within)
        leader = unique[_lowest(ends, len(unique))][np.searchsorted(unique, leader)]
    return leader


def _equal(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """The lowest index of an equal point; -0 equals 0."""
    group = Distinct().numbers(points)
    # Groups are numbered as they appear: a number that none before has reached is a group's first.
    first = np.flatnonzero(np.diff(np.maximum.accumulate(group), prepend=-1))
    return first[group]


def _first_of_group(rows: NDArray[np.generic]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The lowest index of an equal row for each row, the order that sorts them, and the group of each sorted row."""
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    starts = np.concatenate(([True], (ordered[1:] != ordered[:-1]).any(axis=1)))
    group = np.cumsum(starts) - 1
    first = np.empty(len(rows), dtype=np.int64)
    first[order] = np.minimum.reduceat(order, np.flatnonzero(starts))[group]
    return first, order, group


def _near(points: NDArray[np.float64], within: float) -> NDArray[np.int64]:
    """(p, 2) pairs of points no farther apart than `within`: all of them, each once or more."""
    found = [np.empty((0, 2), dtype=np.int64)]
    scaled = (points - points.min(axis=0)) / (2.0 * within)
    # Of two points that near, some shift of a lattice twice as wide has both in one cell.
    for shift in product((0.0, 0.5), repeat=3):
        _, order, group = _first_of_group(np.floor(scaled + shift))
        step = 1
        while (same := group[step:] == group[:-step]).any():
            one, other = order[:-step][same], order[step:][same]
            near = np.linalg.norm(points[one] - points[other], axis=1) <= within
            found.append(np.stack((one[near], other[near]), axis=1))
            step += 1
    return np.concatenate(found)


def _lowest(ends: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """The lowest index that the pairs connect each of `count` indices with."""
    label = np.arange(count)
    while (label[ends[:, 0]] != label[ends[:, 1]]).any():
        low = label[ends].min(axis=1)
        np.minimum.at(label, ends[:, 0], low)
        np.minimum.at(label, ends[:, 1], low)
        label = label[label]
    return label
