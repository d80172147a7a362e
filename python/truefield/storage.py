"""Complete fields in files: one versioned file, checked on loading.

Layout of a `.tfield` file, version 1, everything little endian:

| bytes | what |
| --- | --- |
| 8 | the mark `89 54 46 49 45 4c 44 0a` (`\\x89TFIELD\\n`) |
| 4 | version, uint32 |
| 4 | n, the length of the header, uint32 |
| 8 | length of the whole file, uint64 |
| n | header: a JSON object in ASCII, padded with blanks to a multiple of 8 bytes |
| 32 | BLAKE2b-256 of everything before |
| | the arrays, one after another, as the header lists them: name, type, shape |
| 32 | BLAKE2b-256 of everything before |

The header's keys: `name` of the part; `sign` that was asked for and the `sign_rule` it led to; `region`; `origin`,
`cell_size`, `first` and `shape` of the grid, cell (0, 0, 0) of the whole at `origin`, the field's first at `first`;
`arrays`. The arrays: `vertices` (n, 3) float64 and `mesh_triangles` (m, 3) uint32 are the mesh; the rest are the lists,
block after block of 8 x 8 x 8 cells, x slowest, as `crates/truefield/src/field/parts.rs` describes them. The tree and
the sign rule are made anew from the mesh on loading, the same each time.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import struct
from collections.abc import Callable
from io import BufferedReader
from pathlib import Path
from typing import IO, Any, Final, get_args

import numpy as np
from numpy.typing import NDArray

from truefield import _truefield
from truefield.arguments import Progress
from truefield.errors import FileError, TruefieldError
from truefield.fields import CompleteField, Region, Sign, Surface
from truefield.files import PathLike, check_file, replacing
from truefield.mesh import TriangleMesh

Arrays = dict[str, NDArray[Any]]

VERSION: Final = 1
MARK: Final = b"\x89TFIELD\n"

_START: Final = struct.Struct("<8sIIQ")
_DIGEST: Final = 32
_CHUNK: Final = 1 << 22
# In the order of the file: large items first, so that each array is aligned.
_ARRAYS: Final = {
    "vertices": "<f8",
    "mesh_triangles": "<u4",
    "triangles": "<u4",
    "triangle_counts": "<u2",
    "list_counts": "<u2",
    "ends": "<u2",
    "cells": "<u2",
    "wide_entries": "<u2",
    "entries": "|u1",
    "varied": "|u1",
}
_ROWS_OF_THREE: Final = ("vertices", "mesh_triangles")


def save(field: CompleteField, path: PathLike, *, threads: int | None = None, progress: Progress | None = None) -> None:
    """Writes a field with its mesh to one file, for `load`; see `CompleteField.save`."""
    check_file(path)
    surface, mesh = field.surface, field.mesh
    arrays: Arrays = {"vertices": mesh.vertices, "mesh_triangles": mesh.triangles}
    arrays |= _truefield.complete_field_parts(field._native, threads, progress)
    stored = {name: np.ascontiguousarray(arrays.pop(name), dtype) for name, dtype in _ARRAYS.items()}
    header = {
        "name": mesh.name,
        "sign": surface.sign,
        "sign_rule": surface.sign_rule.name,
        "region": field.region,
        "origin": field.origin.tolist(),
        "cell_size": field.cell_size,
        "first": list(field._native.first),
        "shape": list(field.shape),
        "arrays": [[name, array.dtype.str, list(array.shape)] for name, array in stored.items()],
    }
    text = json.dumps(header).encode("ascii")
    text += b" " * (-len(text) % 8)
    size = _START.size + len(text) + 2 * _DIGEST + sum(array.nbytes for array in stored.values())
    with replacing(path) as stream:
        writer = _Writer(stream, size, progress)
        writer.write(_START.pack(MARK, VERSION, len(text), size))
        writer.write(text)
        writer.seal()
        for array in stored.values():
            writer.write(_bytes(array))
        writer.seal()


def load(path: PathLike, *, threads: int | None = None, progress: Progress | None = None) -> CompleteField:
    """Reads a field that `CompleteField.save` wrote: the same answers, bit for bit.

    The whole file is checked, by length, checksums and every index in it, before anything is answered. Takes no more
    than twice the memory of the field, and the time to read the file and to make the surface's tree anew.

    Raises:
        FileError: the file cannot be read, is no such field, truncated, damaged, or from a newer truefield.
    """
    # Later on, the file would be blamed.
    if threads is not None and threads < 1:
        raise TruefieldError(f"threads must be at least 1, or None for all cores, not {threads}")
    file = Path(path)
    try:
        with file.open("rb") as stream:
            header, arrays = _read(stream, file, progress)
    except FileNotFoundError:
        raise FileError(f"cannot read '{file}': there is no such file; check the name") from None
    except IsADirectoryError:
        raise FileError(f"cannot read '{file}': it is a folder; give the name of a file") from None
    except FileError:
        raise
    except OSError as error:
        raise FileError(f"cannot read '{file}': {(error.strerror or str(error)).lower()}") from None
    try:
        mesh = TriangleMesh(arrays.pop("vertices"), arrays.pop("mesh_triangles").astype(np.int64), header["name"])
        surface = Surface(mesh, header["sign"], threads=threads, progress=progress)
        if surface.sign_rule.name != header["sign_rule"]:
            raise FileError(
                f"'{file}' was built with the sign rule '{header['sign_rule']}', but this truefield chooses "
                f"'{surface.sign_rule.name}' for its mesh; build the field again"
            )
        native = _truefield.complete_field_from_parts(
            surface._native,
            header["origin"],
            header["cell_size"],
            header["first"],
            header["shape"],
            header["region"],
            arrays,
            threads,
            progress,
        )
    except FileError:
        raise
    except TruefieldError as error:
        raise FileError(f"'{file}' is no valid field: {error}; build the field again") from None
    return CompleteField(native, surface)


class _Writer:
    """Writes and sums up what it writes."""

    def __init__(self, stream: IO[bytes], size: int, progress: Progress | None) -> None:
        self._stream, self._size, self._progress = stream, size, progress
        self._sum = hashlib.blake2b(digest_size=_DIGEST)
        self._done = 0

    def write(self, view: bytes | memoryview) -> None:
        for start in range(0, len(view), _CHUNK):
            chunk = view[start : start + _CHUNK]
            self._stream.write(chunk)
            self._sum.update(chunk)
            self._done += len(chunk)
            if self._progress is not None:
                self._progress("write field", self._done / self._size)

    def seal(self) -> None:
        self.write(self._sum.digest())


class _Reader:
    """Reads and sums up what it reads."""

    def __init__(self, stream: BufferedReader, file: Path, size: int, progress: Progress | None) -> None:
        self._stream, self._file, self._size, self._progress = stream, file, size, progress
        self._sum = hashlib.blake2b(digest_size=_DIGEST)
        self._done = 0

    def fill(self, view: memoryview) -> None:
        for start in range(0, len(view), _CHUNK):
            chunk = view[start : start + _CHUNK]
            # A buffered stream gives less only where the file ends, and the length was right a moment ago.
            if self._stream.readinto(chunk) < len(chunk):
                raise FileError(f"cannot read '{self._file}': it changed while it was read; try again")
            self._sum.update(chunk)
            self._done += len(chunk)
            if self._progress is not None:
                self._progress("read field", self._done / self._size)

    def read(self, count: int) -> bytes:
        data = bytearray(count)
        self.fill(memoryview(data))
        return bytes(data)

    def check(self) -> None:
        expected = self._sum.digest()
        if self.read(_DIGEST) != expected:
            raise _damaged(self._file)


def _read(
    stream: BufferedReader, file: Path, progress: Progress | None
) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    state = os.fstat(stream.fileno())
    if not stat.S_ISREG(state.st_mode):
        raise FileError(f"cannot read '{file}': it is no ordinary file; give the name of a file that was saved")
    reader = _Reader(stream, file, state.st_size, progress)
    start = reader.read(min(state.st_size, _START.size))
    if start[: len(MARK)] != MARK[: len(start)] or not start:
        raise FileError(
            f"'{file}' is not a truefield field: it does not begin as one; "
            "give a file that CompleteField.save wrote, and meshes to truefield.read"
        )
    if len(start) < _START.size:
        raise _truncated(file, state.st_size, None)
    _, version, header_size, size = _START.unpack(start)
    if version > VERSION:
        raise FileError(
            f"'{file}' was written by a newer truefield, in version {version} of the format, but this one reads "
            f"version {VERSION}; upgrade truefield"
        )
    if state.st_size < size:
        raise _truncated(file, state.st_size, size)
    if version < 1 or state.st_size > size or _START.size + header_size + 2 * _DIGEST > size:
        raise _damaged(file)
    text = reader.read(header_size)
    reader.check()
    try:
        header = _checked_header(text)
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise FileError(f"'{file}' is no valid field: its header cannot be used ({error}); save it again") from None
    shapes = {name: tuple(shape) for name, _, shape in header["arrays"]}
    expected = sum(np.dtype(dtype).itemsize * _product(shapes[name]) for name, dtype in _ARRAYS.items())
    if _START.size + header_size + 2 * _DIGEST + expected != size:
        raise FileError(f"'{file}' is no valid field: its arrays do not fill it; save it again")
    arrays: Arrays = {}
    for name, dtype in _ARRAYS.items():
        array = np.empty(shapes[name], dtype)
        reader.fill(_bytes(array))
        arrays[name] = array.astype(array.dtype.newbyteorder("="), copy=False)
    reader.check()
    return header, arrays


def _checked_header(text: bytes) -> dict[str, Any]:
    """The header, if each of its values is of the kind it must be; else an error that says what is not."""
    header = json.loads(text.decode("ascii"))
    if not isinstance(header, dict):
        raise TypeError("it is no object")
    _expect(header, "name", lambda name: isinstance(name, str))
    _expect(header, "sign", lambda sign: sign in get_args(Sign))
    _expect(header, "sign_rule", lambda rule: isinstance(rule, str))
    _expect(header, "region", lambda region: region in get_args(Region))
    _expect(header, "origin", lambda origin: _three(origin, float))
    _expect(header, "cell_size", lambda size: isinstance(size, float))
    _expect(header, "first", lambda first: _three(first, int) and all(abs(i) < 2**62 for i in first))
    _expect(header, "shape", lambda shape: _three(shape, int) and all(0 < n < 2**32 for n in shape))
    _expect(header, "arrays", lambda arrays: isinstance(arrays, list) and len(arrays) == len(_ARRAYS))
    for entry, (name, dtype) in zip(header["arrays"], _ARRAYS.items(), strict=True):
        rows = 2 if name in _ROWS_OF_THREE else 1
        given_name, given_dtype, shape = entry
        lengths = isinstance(shape, list) and len(shape) == rows and all(type(n) is int and n >= 0 for n in shape)
        if (given_name, given_dtype) != (name, dtype) or not lengths or (rows == 2 and shape[1] != 3):
            raise ValueError(f"arrays lists {entry} where {name}, {dtype} and its shape belong")
    return header


def _expect(header: dict[str, Any], key: str, good: Callable[[Any], bool]) -> None:
    if key not in header:
        raise ValueError(f"it has no {key}")
    if not good(header[key]):
        raise ValueError(f"{key} is {header[key]!r:.80}")


def _three(value: Any, kind: type) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(type(item) is kind for item in value)


def _bytes(array: NDArray[Any]) -> memoryview:
    return array.reshape(-1).view(np.uint8).data


def _product(shape: tuple[int, ...]) -> int:
    count = 1
    for length in shape:
        count *= length
    return count


def _truncated(file: Path, size: int, expected: int | None) -> FileError:
    whole = "" if expected is None else f" of {expected}"
    return FileError(f"'{file}' is truncated: it has only {size}{whole} bytes; copy it again or build the field again")


def _damaged(file: Path) -> FileError:
    return FileError(f"'{file}' is damaged: its checksum does not match; copy it again or build the field again")
