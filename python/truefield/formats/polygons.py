"""What every reader returns, and the steps they share: polygons to triangles, equal vertices to one."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import shorten
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class FormatError(ValueError):
    """The content of a file is not what its format asks for; the message is half a sentence."""


class Soup(NamedTuple):
    """A mesh as it stands in a file, not yet checked."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]


def fan(corners: NDArray[np.int64], sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles (m, 3) of polygons: each a fan around its first corner, in order.

    `corners` holds all polygons' vertex indices one after another, `sizes` how many each has, at least 3.
    A fan covers a flat convex polygon exactly; of any other it is one of the surfaces through its corners.
    """
    if len(sizes) == 0:
        return np.empty((0, 3), dtype=np.int64)
    if (sizes == 3).all():
        return corners.reshape(-1, 3)
    first = np.cumsum(sizes) - sizes
    count = sizes - 2
    apex = np.repeat(first, count)
    step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    picks: NDArray[np.int64] = np.stack((apex, apex + step + 1, apex + step + 2), axis=1)
    return np.take(corners, picks)


def merge_equal(soup: Soup) -> Soup:
    """Makes vertices of exactly equal coordinates one, in order of first appearance; -0 equals 0.

    Only for formats that cannot share a vertex: without it no edge of theirs would have two triangles.
    """
    from truefield.weld import leaders

    if len(soup.vertices) == 0 or not np.isfinite(soup.vertices).all():
        return soup  # the mesh's own check names the vertex
    leader = leaders(soup.vertices, 0.0)
    kept = np.flatnonzero(leader == np.arange(len(leader)))
    return Soup(soup.vertices[kept] + 0.0, np.searchsorted(kept, leader)[soup.triangles])


def reason(error: Exception) -> str:
    """Another library's error on one short line."""
    return shorten(f"{type(error).__name__}: {error}", 120, placeholder=" ...")


def numbers(tokens: Sequence[bytes], what: str) -> NDArray[np.float64]:
    """The tokens as float64; `what` names them in the error."""
    try:
        return np.array(list(map(float, tokens)), dtype=np.float64)
    except ValueError as error:
        raise FormatError(f"{what} holds something that is no number ({error})") from None


def integers(tokens: Sequence[bytes], what: str) -> NDArray[np.int64]:
    """The tokens as int64; `what` names them in the error."""
    try:
        return np.array(list(map(int, tokens)), dtype=np.int64)
    except (ValueError, OverflowError) as error:
        raise FormatError(f"{what} holds something that is no whole number ({error})") from None
