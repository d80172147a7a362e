"""OFF, text: a count line, vertices, polygons; colours and normals are passed over."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import numpy as np

from truefield.formats.polygons import FormatError, Soup, fan, integers, numbers

if TYPE_CHECKING:
    from truefield.mesh import TriangleMesh

_HEADER: Final = re.compile(rb"(ST)?C?N?OFF\b", re.IGNORECASE)


def decode(data: bytes) -> Soup:
    """Reads OFF, COFF, NOFF and their mixtures: three dimensions, text."""
    lines = [words for line in data.splitlines() if (words := line.partition(b"#")[0].split())]
    if not lines or not _HEADER.fullmatch(lines[0][0]):
        raise FormatError("it does not begin with 'OFF', so it is no OFF in text with three dimensions")
    if lines[0][1:2] and lines[0][1].upper() == b"BINARY":
        raise FormatError("it is a binary OFF; export it as text")
    lines[0] = lines[0][1:]
    if not lines[0]:
        del lines[0]
    counts = integers(lines[0][:3], "the count line") if lines else np.empty(0, dtype=np.int64)
    if len(counts) < 2 or (counts < 0).any():
        raise FormatError(
            "its count line is missing or malformed; it must say how many vertices, faces and edges follow"
        )
    vertex_count, face_count = int(counts[0]), int(counts[1])
    if len(lines) - 1 != vertex_count + face_count:
        state = "is truncated" if len(lines) - 1 < vertex_count + face_count else "goes on after its last face"
        raise FormatError(
            f"it {state}: it declares {vertex_count} vertices and {face_count} faces, and {len(lines) - 1} lines follow"
        )
    rows = lines[1 : 1 + vertex_count]
    if any(len(row) < 3 for row in rows):
        index = next(i for i, row in enumerate(rows) if len(row) < 3)
        raise FormatError(f"vertex {index} has {len(rows[index])} coordinates instead of 3")
    vertices = numbers([word for row in rows for word in row[:3]], "a vertex").reshape(-1, 3)
    faces = lines[1 + vertex_count : 1 + vertex_count + face_count]
    sizes = integers([row[0] for row in faces], "a face's corner count")
    for index, (row, size) in enumerate(zip(faces, sizes.tolist(), strict=True)):
        if size < 3 or len(row) <= size:
            raise FormatError(f"face {index} declares {size} corners and lists {len(row) - 1}; a face needs 3 or more")
    corners = integers(
        [word for row, size in zip(faces, sizes.tolist(), strict=True) for word in row[1 : size + 1]], "a face"
    )
    return Soup(vertices, fan(corners, sizes))


def encode(mesh: TriangleMesh) -> bytes:
    """OFF with shortest decimals that read back as the same float64."""
    lines = ["OFF", f"{len(mesh.vertices)} {len(mesh.triangles)} 0"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"3 {a} {b} {c}" for a, b, c in mesh.triangles.tolist()]
    return ("\n".join(lines) + "\n").encode("ascii")
