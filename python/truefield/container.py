"""The file around a field: one versioned file of named arrays, checked on loading.

Layout of a `.tfield` file, version 1, everything little endian:

| bytes | what |
| --- | --- |
| 8 | the mark `89 54 46 49 45 4c 44 0a` (`\\x89TFIELD\\n`) |
| 4 | version, uint32 |
| 4 | n, the length of the header, uint32 |
| 8 | length of the whole file, uint64 |
| n | header: a JSON object in ASCII, padded with blanks to a multiple of 8 bytes |
| 32 | BLAKE2b-256 of everything before |
| | the arrays, one after another, as the header's `arrays` lists them: name, type, shape |
| 32 | BLAKE2b-256 of everything before |

A header may have `sums`: the BLAKE2b-256 of each array, so that the first ones can be checked without the rest.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import struct
from collections.abc import Callable, Mapping
from io import BufferedReader, BytesIO
from pathlib import Path
from typing import IO, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from truefield.arguments import Progress
from truefield.errors import FileError
from truefield.files import PathLike, check_file, replacing, size_of

Header = dict[str, Any]
Arrays = dict[str, NDArray[Any]]

VERSION: Final = 1
MARK: Final = b"\x89TFIELD\n"

_START: Final = struct.Struct("<8sIIQ")
_DIGEST: Final = 32
_CHUNK: Final = 1 << 22


class Kept(NamedTuple):
    """An array of a file: its type, and whether it has rows of three or is flat."""

    dtype: str
    rows: bool = False


def write(path: PathLike, header: Header, arrays: Mapping[str, NDArray[Any]], progress: Progress | None) -> None:
    """Writes a header, which is given the list of arrays, and the arrays, as they are.

    Raises:
        FileError: the file cannot be written.
    """
    check_file(path)
    with replacing(path) as stream:
        pack(stream, header, arrays, progress)


def pack(stream: IO[bytes], header: Header, arrays: Mapping[str, NDArray[Any]], progress: Progress | None) -> None:
    """Writes header and arrays to a stream; see `write`."""
    listed = [[name, array.dtype.str, list(array.shape)] for name, array in arrays.items()]
    if header.get("sums"):
        header = header | {"sums": {name: _sum(_bytes(array)) for name, array in arrays.items()}}
    text = json.dumps(header | {"arrays": listed}).encode("ascii")
    text += b" " * (-len(text) % 8)
    size = _START.size + len(text) + 2 * _DIGEST + sum(array.nbytes for array in arrays.values())
    writer = _Writer(stream, size, progress)
    writer.write(_START.pack(MARK, VERSION, len(text), size))
    writer.write(text)
    writer.seal()
    for array in arrays.values():
        writer.write(_bytes(array))
    writer.seal()


def read(
    file: Path,
    check: Callable[[Header], Mapping[str, Kept]],
    progress: Progress | None,
    first: Callable[[Header], int] | None = None,
) -> tuple[Header, Arrays]:
    """Header and arrays of a file, every length and checksum verified.

    `check` is given the header, raises `ValueError` where one of its values cannot be, and says which arrays belong.
    With `first`, which says how many, no more than the first arrays are read, each by the checksum that the header of
    a file written with `sums` has of it; the rest of the file may be missing.

    Raises:
        FileError: the file cannot be read, is none of its kind, truncated, damaged, or from a newer truefield.
    """
    try:
        with file.open("rb") as stream:
            if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
                raise FileError(f"cannot read '{file}': it is no ordinary file; give the name of a file that was saved")
            return unpack(stream, file, check, progress, first)
    except FileNotFoundError:
        raise FileError(f"cannot read '{file}': there is no such file; check the name") from None
    except IsADirectoryError:
        raise FileError(f"cannot read '{file}': it is a folder; give the name of a file") from None
    except FileError:
        raise
    except OSError as error:
        raise FileError(f"cannot read '{file}': {(error.strerror or str(error)).lower()}") from None


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

    def __init__(self, stream: BufferedReader | BytesIO, file: Path, size: int, progress: Progress | None) -> None:
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


def unpack(
    stream: BufferedReader | BytesIO,
    file: Path,
    check: Callable[[Header], Mapping[str, Kept]],
    progress: Progress | None = None,
    first: Callable[[Header], int] | None = None,
) -> tuple[Header, Arrays]:
    """Header and arrays from a stream, which messages call `file`; see `read`."""
    there = size_of(stream)
    reader = _Reader(stream, file, there, progress)
    start = reader.read(min(there, _START.size))
    if start[: len(MARK)] != MARK[: len(start)] or not start:
        raise FileError(
            f"'{file}' is not a truefield field: it does not begin as one; "
            "give a file that a field's save wrote, and meshes to truefield.read"
        )
    if len(start) < _START.size:
        raise _truncated(file, there, None)
    _, version, header_size, size = _START.unpack(start)
    if version > VERSION:
        raise FileError(
            f"'{file}' was written by a newer truefield, in version {version} of the format, but this one reads "
            f"version {VERSION}; upgrade truefield"
        )
    if there < size and (first is None or there < _START.size + header_size + _DIGEST):
        raise _truncated(file, there, size)
    if version < 1 or there > size or _START.size + header_size + 2 * _DIGEST > size:
        raise _damaged(file)
    text = reader.read(header_size)
    reader.check()
    try:
        header, kept = _checked_header(text, check)
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise FileError(f"'{file}' is no valid field: its header cannot be used ({error}); save it again") from None
    shapes = {name: tuple(shape) for name, _, shape in header["arrays"]}
    expected = sum(np.dtype(array.dtype).itemsize * _product(shapes[name]) for name, array in kept.items())
    if _START.size + header_size + 2 * _DIGEST + expected != size:
        raise FileError(f"'{file}' is no valid field: its arrays do not fill it; save it again")
    arrays: Arrays = {}
    sums = header.get("sums", {}) if first is not None else {}
    left = there - _START.size - header_size - _DIGEST
    wanted = len(kept) if first is None else first(header)
    for name, (dtype, _) in list(kept.items())[:wanted]:
        left -= np.dtype(dtype).itemsize * _product(shapes[name])
        if left < 0:
            raise _truncated(file, there, size)
        array = np.empty(shapes[name], dtype)
        reader.fill(_bytes(array))
        if first is not None and sums.get(name) != _sum(_bytes(array)):
            raise _damaged(file)
        arrays[name] = array.astype(array.dtype.newbyteorder("="), copy=False)
    if first is None:
        reader.check()
    return header, arrays


def _checked_header(text: bytes, check: Callable[[Header], Mapping[str, Kept]]) -> tuple[Header, Mapping[str, Kept]]:
    """The header, if each of its values is of the kind it must be, and its arrays; else an error that says what not."""
    header = json.loads(text.decode("ascii"))
    if not isinstance(header, dict):
        raise TypeError("it is no object")
    kept = check(header)
    expect(header, "arrays", lambda arrays: isinstance(arrays, list) and len(arrays) == len(kept))
    for entry, (name, (dtype, rows)) in zip(header["arrays"], kept.items(), strict=True):
        given_name, given_dtype, shape = entry
        axes = 2 if rows else 1
        lengths = isinstance(shape, list) and len(shape) == axes and all(type(n) is int and n >= 0 for n in shape)
        if (given_name, given_dtype) != (name, dtype) or not lengths or (rows and shape[1] != 3):
            raise ValueError(f"arrays lists {entry} where {name}, {dtype} and its shape belong")
    return header, kept


def expect(header: Header, key: str, good: Callable[[Any], bool]) -> None:
    """Raises `ValueError` if the header has no such key, or one that is not good."""
    if key not in header:
        raise ValueError(f"it has no {key}")
    if not good(header[key]):
        raise ValueError(f"{key} is {header[key]!r:.80}")


def three(value: Any, kind: type) -> bool:
    """Whether it is a list of three of a kind."""
    return isinstance(value, list) and len(value) == 3 and all(type(item) is kind for item in value)


def _sum(view: memoryview) -> str:
    return hashlib.blake2b(view, digest_size=_DIGEST).hexdigest()


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
