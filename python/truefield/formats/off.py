"""OFF, text: a count line, vertices, polygons; colours and normals are passed over."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import chain
from typing import IO, TYPE_CHECKING, Final

import numpy as np

from truefield.formats.polygons import Column, FormatError, Soup, fan, integers, numbers, pieces, write_rows

if TYPE_CHECKING:
    from truefield.mesh import TriangleMesh

_HEADER: Final = re.compile(rb"(ST)?C?N?OFF\b", re.IGNORECASE)


def decode(stream: IO[bytes]) -> Soup:
    """Reads OFF, COFF, NOFF and their mixtures: three dimensions, text."""
    rows = _rows(stream)
    first = next(rows, [])
    while len(first) < 2 and (more := next(rows, None)) is not None:
        first += more
    vertex_count, face_count = _take_counts(first)
    vertices, corners, sizes = Column(np.float64), Column(np.int64), Column(np.int64)
    seen, fault = 0, None
    for lines in chain([first], rows):
        split = min(max(vertex_count - seen, 0), len(lines))
        try:
            # What is wrong with a row matters only where the number of rows is right.
            if fault is None:
                _add_vertices(vertices, lines[:split])
                _add_faces(corners, sizes, lines[split : max(vertex_count + face_count - seen, split)])
        except FormatError as error:
            fault = error
        seen += len(lines)
        lines.clear()  # before the next are read
    if seen != vertex_count + face_count:
        state = "is truncated" if seen < vertex_count + face_count else "goes on after its last face"
        raise FormatError(
            f"it {state}: it declares {vertex_count} vertices and {face_count} faces, and {seen} lines follow"
        )
    if fault is not None:
        raise fault
    return Soup(vertices.array().reshape(-1, 3), fan(corners.array(), sizes.array()))


def _rows(stream: IO[bytes]) -> Iterator[list[list[bytes]]]:
    """The words of all lines that have any, piece by piece."""
    for piece in pieces(stream):
        yield [words for line in piece.splitlines() if (words := line.partition(b"#")[0].split())]


def _take_counts(lines: list[list[bytes]]) -> tuple[int, int]:
    """How many vertices and faces there are; takes the header off the first lines."""
    if not lines or not _HEADER.fullmatch(lines[0][0]):
        raise FormatError("it does not begin with 'OFF', so it is no OFF in text with three dimensions")
    if lines[0][1:2] and lines[0][1].upper() == b"BINARY":
        raise FormatError("it is a binary OFF; export it as text")
    lines[0] = lines[0][1:]
    if not lines[0]:
        del lines[0]
    counts = integers(lines.pop(0)[:3], "the count line") if lines else np.empty(0, dtype=np.int64)
    if len(counts) < 2 or (counts < 0).any():
        raise FormatError(
            "its count line is missing or malformed; it must say how many vertices, faces and edges follow"
        )
    return int(counts[0]), int(counts[1])


def _add_vertices(vertices: Column[np.float64], rows: list[list[bytes]]) -> None:
    for index, row in enumerate(rows, start=len(vertices) // 3):
        if len(row) < 3:
            raise FormatError(f"vertex {index} has {len(row)} coordinates instead of 3")
    vertices.add(numbers([word for row in rows for word in row[:3]], "a vertex"))


def _add_faces(corners: Column[np.int64], sizes: Column[np.int64], rows: list[list[bytes]]) -> None:
    counts = integers([row[0] for row in rows], "a face's corner count")
    for index, (row, size) in enumerate(zip(rows, counts.tolist(), strict=True), start=len(sizes)):
        if size < 3 or len(row) <= size:
            raise FormatError(f"face {index} declares {size} corners and lists {len(row) - 1}; a face needs 3 or more")
    words = [word for row, size in zip(rows, counts.tolist(), strict=True) for word in row[1 : size + 1]]
    corners.add(integers(words, "a face"))
    sizes.add(counts)


def encode(mesh: TriangleMesh, stream: IO[bytes]) -> None:
    """OFF with shortest decimals that read back as the same float64."""
    stream.write(f"OFF\n{len(mesh.vertices)} {len(mesh.triangles)} 0\n".encode("ascii"))
    write_rows(stream, "{!r} {!r} {!r}\n", mesh.vertices)
    write_rows(stream, "3 {} {} {}\n", mesh.triangles)
