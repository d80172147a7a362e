"""NIfTI-1 and NIfTI-2, plain or gzipped, https://nifti.nimh.nih.gov."""

from __future__ import annotations

import gzip
import struct
import zlib
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from truefield.files import replacing
from truefield.formats.polygons import FormatError
from truefield.formats.volumes import raw

if TYPE_CHECKING:
    from truefield.volume import Volume

_CODES: Final = {
    "uint8": 2,
    "int16": 4,
    "int32": 8,
    "float32": 16,
    "float64": 64,
    "int8": 256,
    "uint16": 512,
    "uint32": 768,
    "int64": 1024,
    "uint64": 1280,
}
_DTYPES: Final = {code: name for name, code in _CODES.items()}
_COMMENT: Final = 6
_LONGEST_AXIS: Final = 32767
# Coordinates of NIfTI run to the right, front and head; those of LPS to the left, back and head.
_TURNED: Final = np.array([-1.0, -1.0, 1.0])


class _Layout(NamedTuple):
    """Where the fields of a version are, and how numbers of places are stored."""

    size: int
    magic: tuple[int, bytes]
    dim: tuple[int, str]
    datatype: int
    pixdim: tuple[int, str]
    vox_offset: tuple[int, str]
    slope: tuple[int, str]
    codes: tuple[int, str]
    quatern: tuple[int, str]
    srow: tuple[int, str]


_LAYOUTS: Final = {
    348: _Layout(
        348,
        (344, b"n+1\0"),
        (40, "8h"),
        70,
        (76, "8f"),
        (108, "f"),
        (112, "2f"),
        (252, "2h"),
        (256, "6f"),
        (280, "12f"),
    ),
    540: _Layout(
        540, (4, b"n+2\0"), (16, "8q"), 12, (104, "8d"), (168, "q"), (176, "2d"), (344, "2i"), (352, "6d"), (400, "12d")
    ),
}


def read(path: Path) -> Volume:
    """One volume; its place by sform, else qform, else the spacing alone. A scale in the header is applied.

    Axes of one sample beyond the third are dropped.
    """
    from truefield.volume import Volume

    with path.open("rb") as file:
        zipped = file.peek(2)[:2] == b"\x1f\x8b"
        stream: Any = gzip.GzipFile(fileobj=file) if zipped else file
        try:
            order, layout, header = _header(stream)
            shape, dtype = _shape(header, order, layout), _dtype(header, order, layout)
            start = int(_unpack(header, order, layout.vox_offset)[0])
            extra = stream.read(max(0, start - layout.size))
            values = raw.samples(stream, dtype, shape)
            raw.finished(stream)
        except (zlib.error, gzip.BadGzipFile) as error:
            raise FormatError(f"its compressed content is damaged ({error}); copy it again") from None
    slope, intercept = _unpack(header, order, layout.slope)
    if np.isfinite(slope) and slope != 0.0 and (slope, intercept) != (1.0, 0.0):
        values = values * slope + intercept
    return Volume(values, name=raw.stem(path), **_place(header, order, layout, len(shape), extra))


def write(volume: Volume, path: Path) -> None:
    """Little endian, place as sform; NIfTI-1 where its counts suffice. `.gz` is gzipped.

    NIfTI-1 keeps places in single precision: where that would round, a comment holds the rest.
    """
    values = volume.values.view(np.uint8) if volume.values.dtype == np.bool_ else volume.values
    if values.dtype.name not in _CODES:
        raise FormatError(f"NIfTI has no samples of {values.dtype}; turn them into float32 first")
    layout = _LAYOUTS[348 if max(values.shape) <= _LONGEST_AXIS else 540]
    axes = values.ndim
    matrix = np.zeros((3, 4))
    matrix[:axes, :axes], matrix[:axes, 3] = volume.directions.T, volume.origin
    if axes == 2:
        matrix[2, 2] = 1.0
    if volume.space == "LPS" and axes == 3:
        matrix *= _TURNED[:, None]
    elif volume.space not in ("", "RAS"):
        raise FormatError(f"NIfTI has no space '{volume.space}'; give RAS or LPS, or none")
    header = bytearray(layout.size)
    struct.pack_into("<i", header, 0, layout.size)
    header[layout.magic[0] : layout.magic[0] + 4] = layout.magic[1]
    if layout.size == 540:
        header[8:12] = b"\r\n\x1a\n"
    struct.pack_into("<" + layout.dim[1], header, layout.dim[0], axes, *values.shape, *[1] * (7 - axes))
    struct.pack_into("<2h", header, layout.datatype, _CODES[values.dtype.name], 8 * values.dtype.itemsize)
    struct.pack_into("<" + layout.pixdim[1], header, layout.pixdim[0], 1.0, *volume.spacing, *[1.0] * (7 - axes))
    struct.pack_into("<" + layout.slope[1], header, layout.slope[0], 1.0, 0.0)
    struct.pack_into("<" + layout.codes[1], header, layout.codes[0], 0, 1 if volume.space else 2)
    struct.pack_into("<" + layout.srow[1], header, layout.srow[0], *matrix.reshape(-1))
    stored = np.array(_unpack(bytes(header), "<", layout.srow)).reshape(3, 4)
    extra = b"\0\0\0\0"
    if not np.array_equal(stored, matrix) or volume.space == "LPS":
        text = raw.note(volume).encode()
        size = 8 + len(text) + -(8 + len(text)) % 16
        extra = b"\1\0\0\0" + struct.pack("<2i", size, _COMMENT) + text.ljust(size - 8, b"\0")
    struct.pack_into("<" + layout.vox_offset[1], header, layout.vox_offset[0], layout.size + len(extra))
    with replacing(path) as file:
        if path.suffix.lower() != ".gz":
            file.write(bytes(header) + extra)
            raw.put(file, values)
            return
        # No name and time in the file: the same volume gives the same bytes.
        with gzip.GzipFile(filename="", fileobj=file, mode="wb", compresslevel=6, mtime=0) as zipped:
            zipped.write(bytes(header) + extra)
            raw.put(zipped, values)  # type: ignore[arg-type]


def _header(stream: IO[bytes]) -> tuple[Literal["<", ">"], _Layout, bytes]:
    start = stream.read(4)
    orders: tuple[Literal["<"], Literal[">"]] = ("<", ">")
    for order in orders:
        size = struct.unpack(order + "i", start)[0] if len(start) == 4 else 0
        layout = _LAYOUTS.get(size)
        if layout is None:
            continue
        header = start + stream.read(size - 4)
        if len(header) < size:
            raise FormatError("it ends within its header; copy it again")
        at, magic = layout.magic
        found = header[at : at + 4]
        if found in (b"ni1\0", b"ni2\0"):
            raise FormatError("its samples are in another file (.img); save it as one .nii")
        if found != magic:
            raise FormatError("its header does not hold the mark of NIfTI; save it as NIfTI again")
        return order, layout, header
    raise FormatError("it does not begin as NIfTI-1 or NIfTI-2 do; save it as NIfTI again")


def _unpack(header: bytes, order: str, field: tuple[int, str]) -> tuple[Any, ...]:
    return struct.unpack_from(order + field[1], header, field[0])


def _shape(header: bytes, order: str, layout: _Layout) -> list[int]:
    axes, *lengths = _unpack(header, order, layout.dim)
    if not 1 <= axes <= 7 or any(n < 1 for n in lengths[:axes]):
        raise FormatError(f"its header has {axes} axes of {lengths[: max(0, axes)]} samples; they must be positive")
    shape = list(lengths[:axes])
    while len(shape) > 3 and shape[-1] == 1:
        shape.pop()
    if len(shape) not in (2, 3):
        raise FormatError(f"it has {len(shape)} axes of {shape} samples; give a single volume")
    return shape


def _dtype(header: bytes, order: Literal["<", ">"], layout: _Layout) -> np.dtype[Any]:
    code, bits = struct.unpack_from(order + "2h", header, layout.datatype)
    if code not in _DTYPES:
        raise FormatError(f"its samples are of NIfTI type {code}; give single integers or floats")
    dtype: np.dtype[Any] = np.dtype(_DTYPES[code]).newbyteorder(order)
    if bits != 8 * dtype.itemsize:
        raise FormatError(f"its header says {bits} bit for samples of {8 * dtype.itemsize}; it is damaged")
    return dtype


def _place(header: bytes, order: str, layout: _Layout, axes: int, extra: bytes) -> dict[str, Any]:
    qform, sform = _unpack(header, order, layout.codes)
    pixdim = _unpack(header, order, layout.pixdim)
    spacing = np.abs(np.array(pixdim[1 : axes + 1], dtype=np.float64))
    spacing[~(spacing > 0)] = 1.0
    if sform > 0:
        matrix = np.array(_unpack(header, order, layout.srow), dtype=np.float64).reshape(3, 4)
    elif qform > 0:
        *quatern, x, y, z = _unpack(header, order, layout.quatern)
        steps = np.ones(3)
        steps[:axes] = spacing
        matrix = np.column_stack((_rotation(quatern, pixdim[0]) * steps, (x, y, z)))
    else:
        return {"spacing": spacing}
    place = {
        "directions": matrix[:axes, :axes].T,
        "origin": matrix[:axes, 3],
        "space": "RAS" if (sform or qform) == 1 else "",
    }
    noted = _noted(extra, order, axes)
    if noted is not None and sform > 0:
        turned = _TURNED if noted["space"] == "LPS" and axes == 3 else np.ones(axes)
        single = layout.srow[1][-1]
        exact = np.column_stack(((noted["directions"] * turned).T, noted["origin"] * turned))
        rounded = exact.astype(np.float32).astype(np.float64) if single == "f" else exact
        # Whoever moved the volume since did not mean the note.
        if np.array_equal(rounded, np.column_stack((matrix[:axes, :axes], matrix[:axes, 3]))):
            return noted
    return place


def _noted(extra: bytes, order: str, axes: int) -> dict[str, Any] | None:
    at = 4
    while extra[:1] == b"\1" and at + 8 <= len(extra):
        size, code = struct.unpack_from(order + "2i", extra, at)
        if size < 8 or at + size > len(extra):
            return None
        if code == _COMMENT:
            found = raw.noted(extra[at + 8 : at + size].rstrip(b"\0").decode("utf-8", "replace"), axes)
            if found is not None:
                return found
        at += size
    return None


def _rotation(quatern: list[float], handedness: float) -> NDArray[np.float64]:
    """The rotation of a unit quaternion whose first part is left out; its last column may be turned."""
    b, c, d = quatern
    a = np.sqrt(max(0.0, 1.0 - (b * b + c * c + d * d)))
    rotation = np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c],
        ]
    )
    if handedness < 0:
        rotation[:, 2] = -rotation[:, 2]
    return rotation
