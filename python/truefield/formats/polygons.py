"""What every reader returns, and the steps they share: polygons to triangles, equal vertices to one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import shorten
from typing import IO, Final, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from truefield._truefield import Distinct

_PIECE: Final = 1 << 18
_ROWS: Final = 1 << 14
_Number = TypeVar("_Number", np.float64, np.int64)


class FormatError(ValueError):
    """The content of a file is not what its format asks for; the message is half a sentence."""


class Soup(NamedTuple):
    """A mesh as it stands in a file, not yet checked."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]


class Column(Generic[_Number]):
    """Numbers that come piece by piece; the array of all takes them over without a copy."""

    def __init__(self, kind: type[_Number]) -> None:
        """None yet."""
        self._kind: np.dtype[_Number] = np.dtype(kind)
        self._bytes = bytearray()

    def add(self, numbers: NDArray[_Number]) -> None:
        """More of them, in order."""
        self._bytes += np.ascontiguousarray(numbers, self._kind).data.cast("B") if numbers.size else b""

    def __len__(self) -> int:
        """How many there are."""
        return len(self._bytes) // int(self._kind.itemsize)

    def array(self) -> NDArray[_Number]:
        """All of them, (n,); nothing can be added then."""
        return np.frombuffer(self._bytes, dtype=self._kind)


def pieces(stream: IO[bytes]) -> Iterator[bytes]:
    """What is left of a text, in pieces of whole lines, about 256 kB each."""
    while lines := stream.readlines(_PIECE):
        yield b"".join(lines)


def write_rows(stream: IO[bytes], line: str, rows: NDArray[_Number], added: int = 0) -> None:
    """Each row (n, k) as a line, after something is added to it; some rows at a time."""
    for start in range(0, len(rows), _ROWS):
        part = rows[start : start + _ROWS] + added
        stream.write("".join(line.format(*row) for row in part.tolist()).encode("ascii"))


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
    distinct = Distinct()
    numbers = distinct.numbers(soup.vertices)
    return Soup(distinct.take(), numbers[soup.triangles])


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
