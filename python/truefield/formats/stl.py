"""STL, binary and text. It has no indices: equal corners become one vertex."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from truefield.formats.polygons import FormatError, Soup, merge_equal, numbers

if TYPE_CHECKING:
    from truefield.mesh import TriangleMesh

_HEADER: Final = 84
_CHUNK: Final = 1 << 16
# Of the longest side: rounding that can be seen.
_MOST_MOVED: Final = 1e-3
_FACET: Final = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def decode(data: bytes) -> Soup:
    """Reads either kind; which one is told by the size, since binary files may begin with `solid` too."""
    count = int.from_bytes(data[80:_HEADER], "little") if len(data) >= _HEADER else -1
    if count >= 0 and len(data) == _HEADER + count * _FACET.itemsize:
        corners = np.frombuffer(data, dtype=_FACET, offset=_HEADER)["corners"].astype(np.float64)
    elif data.lstrip()[:5].lower() == b"solid" and b"\0" not in data:
        corners = _decode_text(data)
    elif count < 0:
        raise FormatError(f"it is {len(data)} bytes long, too short for a binary STL, and does not begin with 'solid'")
    else:
        needed = _HEADER + count * _FACET.itemsize
        state = "is truncated" if len(data) < needed else "is no STL or holds more than it says"
        raise FormatError(
            f"it {state}: a binary STL of the {count} triangles it declares has {needed} bytes, this file {len(data)}"
        )
    vertices = corners.reshape(-1, 3)
    return merge_equal(Soup(vertices, np.arange(len(vertices), dtype=np.int64).reshape(-1, 3)))


def _decode_text(data: bytes) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    if b"endsolid" not in data.lower():
        raise FormatError("it is truncated: it has no 'endsolid'")
    tokens: list[bytes] = []
    facets = solids = 0
    for number, line in enumerate(data.splitlines(), start=1):
        words = line.split()
        key = words[0].lower() if words else b""
        if key == b"vertex":
            if len(words) != 4:
                raise FormatError(f"line {number} has {len(words) - 1} coordinates where a vertex has 3")
            tokens += words[1:]
        elif key == b"endfacet":
            facets += 1
            if len(tokens) != 9 * facets:
                raise FormatError(f"the facet that ends in line {number} does not have exactly 3 vertices")
        elif key == b"solid":
            solids += 1
        elif key == b"endsolid":
            solids -= 1
        elif key not in (b"", b"facet", b"outer", b"endloop"):
            raise FormatError(
                f"line {number} begins with {key.decode(errors='replace')!r}, which is no word of a text STL"
            )
    if solids > 0 or len(tokens) != 9 * facets:
        raise FormatError("it is truncated: the last 'endfacet' or 'endsolid' is missing")
    return numbers(tokens, "a vertex")


def encode(mesh: TriangleMesh) -> bytes:
    """Binary STL; coordinates are rounded to float32. Refuses meshes that rounding would spoil."""
    facets = np.zeros(len(mesh.triangles), dtype=_FACET)
    moved = 0.0
    for start in range(0, len(facets), _CHUNK):
        part = facets[start : start + _CHUNK]
        corners = mesh.vertices[mesh.triangles[start : start + _CHUNK]]
        # What single precision cannot hold is found below.
        with np.errstate(all="ignore"):
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            length = np.linalg.norm(normals, axis=1, keepdims=True)
            part["normal"] = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
            part["corners"] = corners
        moved = max(moved, float(np.abs(part["corners"] - corners).max()))
    size = float(np.max(mesh.extent[1] - mesh.extent[0]))
    if moved > _MOST_MOVED * size:
        raise FormatError(
            f"STL keeps single precision, which would move vertices by {moved:.3g} in a part of size {size:.3g}"
        )
    title = f"truefield {mesh.name}".encode("ascii", "replace")[:80].ljust(80)
    return b"".join((title, len(facets).to_bytes(4, "little"), facets.data))
