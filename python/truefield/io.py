"""Reading meshes and points from files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from truefield.errors import FileError, TruefieldError
from truefield.files import PathLike, size_of
from truefield.formats.polygons import FormatError, Soup
from truefield.mesh import TriangleMesh


def read(path: PathLike) -> TriangleMesh:
    """Reads a mesh: STL (text, binary), OBJ, PLY, OFF, GLB, glTF or 3MF, told by the suffix.

    Nothing is repaired: triangles keep their order and orientation, holes stay holes, degenerate triangles stay.
    Polygons become fans of triangles; several objects of a file are put in one mesh with their transforms applied.
    STL and glTF cannot share a vertex between faces, so theirs of equal coordinates become one; in the other formats
    vertices stay as they are. Files named by a `.gltf` are looked for beside it; nothing is ever downloaded.

    Raises:
        FileError: the file cannot be read, is truncated or no mesh of its format; the sentence says what is wrong.
    """
    from truefield import formats

    file = Path(path)
    suffix = file.suffix.lower()
    if suffix not in formats.READABLE and (file.is_file() or not file.exists()):
        what = f"the suffix '{file.suffix}' is not known" if suffix else "it has no suffix"
        raise FileError(f"cannot read '{file}': {what}; a mesh is one of {', '.join(formats.READABLE)}")
    try:
        with _opened(file) as stream:
            soup = formats.decode(stream, file)
        return _mesh(soup, file)
    except FileError:
        raise
    except FormatError as error:
        raise FileError(f"cannot read '{file}': {error}") from None
    except TruefieldError as error:
        raise FileError(f"'{file}' is no usable mesh: {error}") from None


def read_points(path: PathLike) -> NDArray[np.float64]:
    """Reads points (n, 3), float64, in model units.

    `.csv`, `.xyz` and `.txt`: one point a line, parted by commas, semicolons or blanks; a first line of names is
    allowed and then the columns called x, y and z count, else the first three. `.npy`: an array (n, 3). `.ply`: the
    vertices.

    Raises:
        FileError: the file cannot be read, holds no points, or a point is not finite.
    """
    from truefield.formats import ply, points

    decoders: dict[str, Callable[[IO[bytes]], NDArray[np.float64]]] = {
        **dict.fromkeys((".csv", ".xyz", ".txt"), lambda stream: points.decode_text(stream.read())),
        **{".npy": lambda stream: points.decode_npy(stream.read()), ".ply": ply.decode_points},
    }
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix not in decoders and (file.is_file() or not file.exists()):
        raise FileError(f"cannot read points from '{file}': its suffix must be one of {', '.join(decoders)}")
    try:
        with _opened(file) as stream:
            array = decoders[suffix](stream)
    except FormatError as error:
        raise FileError(f"cannot read points from '{file}': {error}") from None
    if len(array) == 0:
        raise FileError(f"'{file}' holds no points; give at least one")
    finite = np.isfinite(array).all(axis=1)
    if not finite.all():
        index = int(np.argmin(finite))
        raise FileError(
            f"point {index} of '{file}' is {tuple(array[index].tolist())}; all points must be finite numbers"
        )
    return array


@contextmanager
def _opened(file: Path) -> Iterator[IO[bytes]]:
    """A stream of the file's bytes that can be read twice; faults of reading are one sentence."""
    if file.is_dir():
        raise FileError(f"cannot read '{file}': it is a folder; give the name of a file")
    try:
        with file.open("rb") as content:
            stream: IO[bytes] = content if content.seekable() else BytesIO(content.read())
            if size_of(stream) == 0:
                raise FileError(f"cannot read '{file}': the file is empty; export it again")
            yield stream
    except FileNotFoundError:
        raise FileError(f"cannot read '{file}': there is no such file; check the name") from None
    except FileError:
        raise
    except OSError as error:
        raise FileError(f"cannot read '{file}': {(error.strerror or str(error)).lower()}") from None


def _mesh(soup: Soup, file: Path) -> TriangleMesh:
    if len(soup.triangles) == 0:
        raise TruefieldError("it has no triangles; export it as a triangle mesh")
    return TriangleMesh.checked(soup.vertices, soup.triangles, file.stem)
