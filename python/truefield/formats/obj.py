"""Wavefront OBJ: positions and polygons; fields may be parted by any blanks, tabs too."""

from __future__ import annotations

from collections.abc import Iterator
from typing import IO, TYPE_CHECKING

import numpy as np

from truefield.formats.polygons import Column, FormatError, Soup, fan, numbers, pieces, write_rows

if TYPE_CHECKING:
    from truefield.mesh import TriangleMesh

_SURFACES = (b"surf", b"curv", b"curv2", b"cstype")


def decode(stream: IO[bytes]) -> Soup:
    """Reads `v` and `f` lines; polygons become fans, negative indices count back, all else is decoration."""
    vertices, corners, sizes = Column(np.float64), Column(np.int64), Column(np.int64)
    known = before = 0
    curved = False
    for piece in _pieces(stream):
        if b"\0" in piece:
            raise FormatError("it holds zero bytes, so it is no OBJ, which is text")
        positions: list[bytes] = []
        faces: list[int] = []
        counts: list[int] = []
        lines = piece.splitlines()
        for number, line in enumerate(lines, start=before + 1):
            words = line.split()
            key = words[0] if words else b""
            if key == b"v":
                if len(words) < 4:
                    raise FormatError(f"vertex {known} (line {number}) has {len(words) - 1} coordinates instead of 3")
                positions += words[1:4]
                known += 1
            elif key in (b"f", b"fo"):
                face = _corners(words[1:], number)
                if 0 in face:
                    raise FormatError(f"the face in line {number} refers to vertex 0, but OBJ counts from 1")
                if len(face) < 3:
                    raise FormatError(f"the face in line {number} has {len(face)} corners; a face needs 3 or more")
                faces += [index - 1 if index > 0 else index + known for index in face]
                counts.append(len(face))
                if min(faces[-len(face) :]) < 0:
                    raise FormatError(f"the face in line {number} counts back before the first vertex")
            elif key in _SURFACES:
                curved = True
        before += len(lines)
        vertices.add(numbers(positions, "a vertex"))
        corners.add(np.array(faces, dtype=np.int64))
        sizes.add(np.array(counts, dtype=np.int64))
    if curved and not len(sizes):
        raise FormatError("it holds curved surfaces but no faces; export it as triangles")
    if not known and not len(sizes):
        raise FormatError("it holds no 'v' and no 'f' lines, so it is no OBJ or an empty one")
    return Soup(vertices.array().reshape(-1, 3), fan(corners.array(), sizes.array()))


def _pieces(stream: IO[bytes]) -> Iterator[bytes]:
    """Whole lines, those put together that a backslash continues."""
    for piece in pieces(stream):
        whole = piece
        while whole.endswith((b"\\\n", b"\\\r\n")) and (line := stream.readline()):
            whole += line
        yield whole.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ")


def _corners(words: list[bytes], number: int) -> list[int]:
    try:
        face = [int(word.partition(b"/")[0]) for word in words]
    except ValueError as error:
        raise FormatError(f"the face in line {number} holds something that is no index ({error})") from None
    if any(abs(index) >= 2**32 for index in face):
        raise FormatError(f"the face in line {number} refers to a vertex beyond 2^32")
    return face


def encode(mesh: TriangleMesh, stream: IO[bytes]) -> None:
    """OBJ with shortest decimals that read back as the same float64."""
    write_rows(stream, "v {!r} {!r} {!r}\n", mesh.vertices)
    write_rows(stream, "f {} {} {}\n", mesh.triangles, added=1)
