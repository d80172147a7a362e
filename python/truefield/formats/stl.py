"""STL, binary and text. It has no indices: equal corners become one vertex."""

from __future__ import annotations

from typing import IO, TYPE_CHECKING, Final

import numpy as np

from truefield._truefield import Distinct
from truefield.files import size_of
from truefield.formats.polygons import Column, FormatError, Soup, numbers, pieces

if TYPE_CHECKING:
    from truefield.mesh import TriangleMesh

_HEADER: Final = 84
_CHUNK: Final = 1 << 14
# Of the longest side: rounding that can be seen.
_MOST_MOVED: Final = 1e-3
_FACET: Final = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def decode(stream: IO[bytes]) -> Soup:
    """Reads either kind; which one is told by the size, since binary files may begin with `solid` too."""
    size, head = size_of(stream), stream.read(_HEADER)
    count = int.from_bytes(head[80:], "little") if len(head) == _HEADER else -1
    needed = _HEADER + count * _FACET.itemsize
    if count >= 0 and size == needed:
        return _decode_binary(stream, count)
    stream.seek(0)
    if _is_text(stream):
        stream.seek(0)
        return _decode_text(stream)
    if count < 0:
        raise FormatError(f"it is {size} bytes long, too short for a binary STL, and does not begin with 'solid'")
    state = "is truncated" if size < needed else "is no STL or holds more than it says"
    raise FormatError(
        f"it {state}: a binary STL of the {count} triangles it declares has {needed} bytes, this file {size}"
    )


def _decode_binary(stream: IO[bytes], count: int) -> Soup:
    distinct = Distinct()
    triangles = np.empty((count, 3), dtype=np.int64)
    for start in range(0, count, _CHUNK):
        part = triangles[start : start + _CHUNK]
        data = stream.read(len(part) * _FACET.itemsize)
        if len(data) < len(part) * _FACET.itemsize:
            raise FormatError("it became shorter while it was read")
        corners = np.frombuffer(data, dtype=_FACET)["corners"].reshape(-1, 3)
        part[:] = distinct.numbers(corners.astype(np.float64)).reshape(-1, 3)
    return Soup(distinct.take(), triangles)


def _is_text(stream: IO[bytes]) -> bool:
    """Whether it is a text that begins with `solid`; one that has no end is refused."""
    begins = ends = False
    for piece in pieces(stream):
        begins = begins or piece.lstrip()[:5].lower() == b"solid"
        if b"\0" in piece or (not begins and piece.strip()):
            return False
        ends = ends or b"endsolid" in piece.lower()
    if begins and not ends:
        raise FormatError("it is truncated: it has no 'endsolid'")
    return begins


def _decode_text(stream: IO[bytes]) -> Soup:
    distinct, corners = Distinct(), Column(np.int64)
    facets = solids = vertices = before = 0
    for piece in pieces(stream):
        tokens: list[bytes] = []
        lines = piece.splitlines()
        for number, line in enumerate(lines, start=before + 1):
            words = line.split()
            key = words[0].lower() if words else b""
            if key == b"vertex":
                if len(words) != 4:
                    raise FormatError(f"line {number} has {len(words) - 1} coordinates where a vertex has 3")
                tokens += words[1:]
                vertices += 1
            elif key == b"endfacet":
                facets += 1
                if vertices != 3 * facets:
                    raise FormatError(f"the facet that ends in line {number} does not have exactly 3 vertices")
            elif key == b"solid":
                solids += 1
            elif key == b"endsolid":
                solids -= 1
            elif key not in (b"", b"facet", b"outer", b"endloop"):
                raise FormatError(
                    f"line {number} begins with {key.decode(errors='replace')!r}, which is no word of a text STL"
                )
        before += len(lines)
        corners.add(distinct.numbers(numbers(tokens, "a vertex").reshape(-1, 3)))
    if solids > 0 or vertices != 3 * facets:
        raise FormatError("it is truncated: the last 'endfacet' or 'endsolid' is missing")
    return Soup(distinct.take(), corners.array().reshape(-1, 3))


def encode(mesh: TriangleMesh, stream: IO[bytes]) -> None:
    """Binary STL; coordinates are rounded to float32. Refuses meshes that rounding would spoil."""
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[mesh.triangles] = True
    moved = 0.0
    for start in range(0, len(used), _CHUNK):
        part = mesh.vertices[start : start + _CHUNK][used[start : start + _CHUNK]]
        # What single precision cannot hold is found below.
        with np.errstate(all="ignore"):
            moved = max(moved, float(np.abs(part.astype(np.float32) - part).max(initial=0.0)))
    size = float(np.max(mesh.extent[1] - mesh.extent[0]))
    if moved > _MOST_MOVED * size:
        raise FormatError(
            f"STL keeps single precision, which would move vertices by {moved:.3g} in a part of size {size:.3g}"
        )
    stream.write(f"truefield {mesh.name}".encode("ascii", "replace")[:80].ljust(80))
    stream.write(len(mesh.triangles).to_bytes(4, "little"))
    for start in range(0, len(mesh.triangles), _CHUNK):
        corners = mesh.vertices[mesh.triangles[start : start + _CHUNK]]
        facets = np.zeros(len(corners), dtype=_FACET)
        with np.errstate(all="ignore"):
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            facets["normal"] = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
        facets["corners"] = corners
        stream.write(facets.data)
