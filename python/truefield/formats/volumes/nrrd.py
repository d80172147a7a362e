"""NRRD: a text header and samples, https://teem.sourceforge.net/nrrd/format.html."""

from __future__ import annotations

import bz2
import gzip
import re
import zlib
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from truefield.errors import FileError
from truefield.files import replacing
from truefield.formats.polygons import FormatError
from truefield.formats.volumes import raw

if TYPE_CHECKING:
    from truefield.volume import Volume

_TYPES: Final = {
    "int8": ("signed char", "int8", "int8_t"),
    "uint8": ("uchar", "unsigned char", "uint8", "uint8_t"),
    "int16": ("short", "short int", "signed short", "signed short int", "int16", "int16_t"),
    "uint16": ("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"),
    "int32": ("int", "signed int", "int32", "int32_t"),
    "uint32": ("uint", "unsigned int", "uint32", "uint32_t"),
    "int64": ("longlong", "long long", "long long int", "signed long long", "int64", "int64_t"),
    "uint64": ("ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"),
    "float32": ("float", "float32"),
    "float64": ("double", "float64"),
}
_DTYPES: Final = {word: dtype for dtype, words in _TYPES.items() for word in words}
_SPACES: Final = {"LPS": "left-posterior-superior", "RAS": "right-anterior-superior", "LAS": "left-anterior-superior"}
_SHORT: Final = {long: short for short, long in _SPACES.items()}
_LONGEST_HEADER: Final = 1 << 20


def read(path: Path) -> Volume:
    """Header and samples, attached or in a file of their own beside the header; raw, gzip, bzip2 or text."""
    from truefield.volume import Volume

    with path.open("rb") as stream:
        header = _header(stream)
        axes = _whole(header, "dimension")
        shape = [int(n) for n in _numbers(header, "sizes", axes)]
        if axes not in (2, 3):
            raise FormatError(f"it has {axes} axes; give an image or a volume of single values")
        if any(n < 1 for n in shape):
            raise FormatError(f"its sizes are {shape}; they must be positive")
        place = _place(header, axes)
        dtype = _dtype(header)
        if "data file" in header:
            with _beside(path, header["data file"]).open("rb") as data:
                values = _samples(data, header, dtype, shape)
        else:
            values = _samples(stream, header, dtype, shape)
    return Volume(values, name=raw.stem(path), **place)


def write(volume: Volume, path: Path) -> None:
    """Attached, raw, little endian; a boolean is written as 0 or 1 of 8 bit."""
    values = volume.values.view(np.uint8) if volume.values.dtype == np.bool_ else volume.values
    if values.dtype.name not in _TYPES:
        raise FormatError(f"NRRD has no samples of {values.dtype}; turn them into float32 first")
    axes = values.ndim
    lines = ["NRRD0004", f"type: {_TYPES[values.dtype.name][-1 if values.dtype.kind != 'f' else 0]}"]
    lines += [f"dimension: {axes}", f"sizes: {' '.join(map(str, values.shape))}"]
    if volume.space and axes != 3:
        raise FormatError(f"NRRD knows the space '{volume.space}' of volumes only, not of an image")
    space = " ".join(volume.space.split())
    lines.append(f"space: {_SPACES.get(space, space)}" if space else f"space dimension: {axes}")
    lines += [f"space directions: {' '.join(_vector(row) for row in volume.directions)}"]
    lines += [f"space origin: {_vector(volume.origin)}", "endian: little", "encoding: raw"]
    with replacing(path) as stream:
        stream.write(("\n".join(lines) + "\n\n").encode("ascii", "replace"))
        raw.put(stream, values)


def _header(stream: IO[bytes]) -> dict[str, str]:
    if not re.fullmatch(rb"NRRD000[1-5]\s*", stream.readline(64)):
        raise FormatError("it does not begin as NRRD versions 1 to 5 do; save it as NRRD again")
    header: dict[str, str] = {}
    size = 0
    while (line := stream.readline(_LONGEST_HEADER).decode("utf-8", "replace").rstrip("\r\n")) != "":
        size += len(line)
        if size > _LONGEST_HEADER:
            raise FormatError("its header does not end; it is damaged")
        if line.startswith("#") or ":=" in line:
            continue
        field, found, value = line.partition(": ")
        if not found:
            raise FormatError(f"its header has the line '{line[:60]}', which is no field")
        field = {"datafile": "data file", "lineskip": "line skip", "byteskip": "byte skip"}.get(
            field.lower(), field.lower()
        )
        if field in header:
            raise FormatError(f"its header has two fields '{field}'")
        header[field] = value.strip()
    for needed in ("type", "dimension", "sizes", "encoding"):
        if needed not in header:
            raise FormatError(f"its header has no field '{needed}'")
    return header


def _dtype(header: dict[str, str]) -> np.dtype[Any]:
    name = _DTYPES.get(" ".join(header["type"].lower().split()))
    if name is None:
        raise FormatError(f"its samples are of type '{header['type']}'; give single integers or floats")
    dtype = np.dtype(name)
    if dtype.itemsize > 1 and header["encoding"].lower() not in ("ascii", "text", "txt"):
        endian = header.get("endian", "").lower()
        if endian not in ("little", "big"):
            raise FormatError("its header does not say whether samples are little or big endian")
        dtype = dtype.newbyteorder("<" if endian == "little" else ">")
    return dtype


def _place(header: dict[str, str], axes: int) -> dict[str, Any]:
    """Origin, directions and space, of whichever fields say so."""
    place: dict[str, Any] = {}
    if "space" in header:
        place["space"] = _SHORT.get(header["space"].lower(), header["space"])
    if "space directions" in header:
        text = header["space directions"]
        rows = [_parsed(vector, text) for vector in re.findall(r"\([^)]*\)|none", text)]
        if len(rows) != axes or any(len(row) != axes for row in rows):
            raise FormatError(f"its space directions '{text}' are not {axes} vectors of {axes} numbers")
        place["directions"] = rows
    elif "spacings" in header:
        place["spacing"] = np.abs(_numbers(header, "spacings", axes))
    if "space origin" in header:
        place["origin"] = _parsed(header["space origin"], header["space origin"])
        if len(place["origin"]) != axes:
            raise FormatError(f"its space origin '{header['space origin']}' is no vector of {axes} numbers")
    elif "axis mins" in header:
        lows = _numbers(header, "axis mins", axes)
        place["origin"] = np.where(np.isfinite(lows), lows, 0.0)
    # Without a spacing of its own, an axis has steps of one.
    if "spacing" in place:
        place["spacing"] = np.where(np.isfinite(place["spacing"]), place["spacing"], 1.0)
    return place


def _samples(stream: IO[bytes], header: dict[str, str], dtype: np.dtype[Any], shape: list[int]) -> NDArray[Any]:
    encoding = header["encoding"].lower()
    lines, skipped = (_whole(header, field) if field in header else 0 for field in ("line skip", "byte skip"))
    for _ in range(lines):
        stream.readline()
    if encoding in ("ascii", "text", "txt"):
        try:
            words = np.array(stream.read().split(), dtype=dtype)
        except (ValueError, OverflowError):
            raise FormatError("its text holds words that are no such numbers") from None
        if len(words) != np.prod(shape):
            raise FormatError(f"it holds {len(words)} numbers, its sizes {shape} promise another count")
        return np.asarray(words.reshape(shape[::-1]).T)
    if encoding == "raw" and skipped == -1:
        stream.seek(-int(np.prod(shape)) * dtype.itemsize, 2)
        skipped = 0
    opened: Any = stream
    if encoding in ("gzip", "gz"):
        opened = gzip.GzipFile(fileobj=stream)
    elif encoding in ("bzip2", "bz2"):
        opened = bz2.BZ2File(stream)
    elif encoding != "raw":
        raise FormatError(f"its encoding is '{header['encoding']}'; save it as raw, gzip, bzip2 or text")
    try:
        opened.read(max(skipped, 0))
        values = raw.samples(opened, dtype, shape)
        raw.finished(opened)
    except (zlib.error, gzip.BadGzipFile, EOFError) as error:
        raise FormatError(f"its compressed samples are damaged ({error}); copy it again") from None
    return values


def _beside(path: Path, name: str) -> Path:
    """The file of the samples; never one outside the header's own folder."""
    if name.split()[:1] == ["LIST"] or "%" in name:
        raise FormatError("its samples are spread over several files; save it as one")
    file = path.parent / name
    if Path(name).is_absolute() or file.resolve().parent != path.resolve().parent:
        raise FormatError(f"its samples are said to be in '{name}', outside of its folder; put them beside it")
    if not file.is_file():
        raise FileError(f"cannot read '{path}': its samples should be in '{file}', which is not there")
    return file


def _whole(header: dict[str, str], field: str) -> int:
    try:
        return int(header[field])
    except ValueError:
        raise FormatError(f"its {field} is '{header[field]}', no whole number") from None


def _numbers(header: dict[str, str], field: str, count: int) -> NDArray[np.float64]:
    try:
        numbers = np.array(header[field].split(), dtype=np.float64)
    except ValueError:
        numbers = np.array([])
    whole = np.isfinite(numbers).all() and np.array_equal(numbers, np.floor(numbers))
    if len(numbers) != count or (field == "sizes" and not whole):
        raise FormatError(f"its {field} are '{header[field]}', not {count} numbers")
    return numbers


def _parsed(vector: str, text: str) -> list[float]:
    try:
        return [float(word) for word in vector.strip("()").split(",")]
    except ValueError:
        raise FormatError(f"'{text}' holds no vector where one should be; give a volume of single values") from None


def _vector(numbers: NDArray[np.float64]) -> str:
    return "(" + ",".join(repr(float(number)) for number in numbers) + ")"
