"""Arguments that many functions take: turned into what they mean, or refused in one sentence."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield.errors import TruefieldError

Floats = NDArray[np.float64]
Progress = Callable[[str, float], None]

_MOST_CELLS_ALONG_A_SIDE = 2**31
_MOST_BYTES = 2**63
_FARTHEST = 1e150


def points(points: ArrayLike) -> Floats:
    """What `vectors` gives, without finite coordinates beyond 1e150: no number holds their squared distances."""
    array = vectors(points)
    if array.size and not (array.min() >= -_FARTHEST and array.max() <= _FARTHEST):
        far = ((np.abs(array) > _FARTHEST) & np.isfinite(array)).any(axis=1)
        if far.any():
            x, y, z = array[np.argmax(far)].tolist()
            raise TruefieldError(
                f"point {int(np.argmax(far))} is ({x}, {y}, {z}), beyond what distances are found for; "
                "give coordinates of 1e150 at most"
            )
    return array


def vectors(points: ArrayLike) -> Floats:
    """(n, 3) float64, C-contiguous and aligned; a single one may be given as (3,)."""
    try:
        array = real(points)
    except (TypeError, ValueError):
        raise TruefieldError("points are not numbers; give an array of shape (n, 3)") from None
    if array.ndim == 1 and array.shape[0] == 3:
        array = array.reshape(1, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise TruefieldError(f"points have shape {array.shape}; give an array of shape (n, 3)")
    return array


def real(values: ArrayLike) -> Floats:
    """Float64, C-contiguous and aligned; raises TypeError or ValueError where values are no real numbers.

    A cast would drop imaginary parts, take dates for numbers and masked places for known ones.
    """
    given = np.asarray(values)
    if given.dtype.kind in "cmM" or np.ma.is_masked(values):
        raise TypeError
    array: Floats = np.require(given, np.float64, ["C", "A"])
    return array


def box(name: str, corners: tuple[ArrayLike, ArrayLike]) -> tuple[list[float], list[float]]:
    """The lowest and the highest corner of a box, as they are given."""
    try:
        array = real([real(corner) for corner in corners])
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != (2, 3):
        said = " ".join(repr(corners).split())
        raise TruefieldError(
            f"{name} is {said:.80}; give the lowest and the highest corner of a box, ((x, y, z), (x, y, z))"
        )
    low, high = array.tolist()
    return low, high


def count(name: str, value: int, least: int) -> int:
    """A whole number of at least `least`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < least:
        raise TruefieldError(f"{name} is {value}; give a whole number of at least {least}")
    return int(value)


def number(name: str, value: float) -> float:
    """Any number."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise TruefieldError(f"{name} is {value!r}; give a number") from None


def length(name: str, value: float, least: float | None = None) -> float:
    """A finite length: positive, or of at least `least`."""
    try:
        length = float(value)
    except (TypeError, ValueError):
        raise TruefieldError(f"{name} is {value!r}; give a length in model units") from None
    if not np.isfinite(length) or (length <= 0.0 if least is None else length < least):
        kind = "positive" if least is None else "finite, not negative"
        raise TruefieldError(f"{name} is {value}; give a {kind} length in model units")
    return length


def shape(counts: Floats, step: float) -> tuple[int, int, int]:
    """Whole numbers of cells or samples along x, y and z, at least one each, from counts by steps of `step`."""
    if not np.all(np.isfinite(counts)) or np.max(counts) > _MOST_CELLS_ALONG_A_SIDE:
        raise TruefieldError(
            f"a step of {step:g} gives {np.max(counts):.3g} cells along a side; give a coarser resolution"
        )
    x, y, z = (max(1, int(np.ceil(count - 1e-9))) for count in counts)
    return x, y, z


def lattice(
    low: Floats, high: Floats, resolution: int | None, spacing: float | None, margin: float
) -> tuple[list[float], float, tuple[int, int, int]]:
    """Origin, spacing and shape of a lattice over a box, by default 256 points along its longest side."""
    low, high = low - length("margin", margin, least=0.0), high + margin
    if resolution is not None and spacing is not None:
        raise TruefieldError("give resolution or spacing, not both")
    if spacing is None:
        points = count("resolution", 256 if resolution is None else resolution, least=2)
        spacing = float(np.max(high - low)) / (points - 1)
    step = length("spacing", spacing)
    counts = shape((high - low) / step + 1.0, step)
    origin = (low + high) / 2 - (np.asarray(counts) - 1) * step / 2
    return origin.tolist(), step, counts


def memory(memory: int | None) -> int:
    """Bytes that a job may take; half the machine's memory by default."""
    if memory is not None:
        return min(count("memory", memory, least=0), _MOST_BYTES)
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2
    except (AttributeError, ValueError, OSError):
        return 4 * 2**30
