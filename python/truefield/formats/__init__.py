"""File formats of meshes and points: one file per format, `decode` and `encode`.

The four plain formats are read here, strictly, because every number in the file must be accounted for: a count that
does not fit, a short line or a word where a number should be is an error and never a silently smaller mesh. The
containers (glTF, 3MF) go through trimesh, and what it returns is counted against what the file declares.
"""

from __future__ import annotations

from pathlib import Path
from typing import IO, TYPE_CHECKING

from truefield.errors import FileError
from truefield.files import PathLike
from truefield.formats import obj, off, ply, stl
from truefield.formats.polygons import FormatError

if TYPE_CHECKING:
    from truefield.formats.polygons import Soup
    from truefield.mesh import TriangleMesh

_DECODERS = {".stl": stl.decode, ".obj": obj.decode, ".ply": ply.decode, ".off": off.decode}
_CONTAINERS = (".glb", ".gltf", ".3mf")
_ENCODERS = {".stl": stl.encode, ".obj": obj.encode, ".ply": ply.encode, ".off": off.encode}
READABLE = (*_DECODERS, *_CONTAINERS)
WRITABLE = tuple(_ENCODERS)


def decode(stream: IO[bytes], path: Path) -> Soup:
    """Vertices and triangles of a file from its begin; `path` gives the format and, for `.gltf`, its neighbours."""
    suffix = path.suffix.lower()
    if suffix in _CONTAINERS:
        from truefield.formats import scene  # brings archives and XML with it

        return scene.decode(stream.read(), path)
    return _DECODERS[suffix](stream)


def check(path: PathLike) -> None:
    """Raises `FileError` if the suffix of `path` names no format of meshes that is written."""
    if Path(path).suffix.lower() not in _ENCODERS:
        raise FileError(f"cannot write a mesh to '{path}': its suffix must be one of {', '.join(WRITABLE)}")


def encode(mesh: TriangleMesh, path: PathLike, stream: IO[bytes]) -> None:
    """Writes the content of a mesh file, piece by piece, in the format that the suffix of `path` names."""
    try:
        _ENCODERS[Path(path).suffix.lower()](mesh, stream)
    except FormatError as error:
        raise FileError(f"cannot write '{path}': {error}; write .ply, .obj or .off") from None
