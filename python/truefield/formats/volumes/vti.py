"""VTK image data, `.vti`: XML around samples, https://docs.vtk.org/en/latest/vtk_file_formats."""

from __future__ import annotations

import base64
import binascii
import lzma
import re
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from truefield.files import replacing
from truefield.formats.polygons import FormatError
from truefield.formats.volumes import raw

if TYPE_CHECKING:
    from truefield.volume import Volume

_TYPES: Final = {
    "Int8": "i1",
    "UInt8": "u1",
    "Int16": "i2",
    "UInt16": "u2",
    "Int32": "i4",
    "UInt32": "u4",
    "Int64": "i8",
    "UInt64": "u8",
    "Float32": "f4",
    "Float64": "f8",
}
_NOTED: Final = 4096
_NAMES: Final = {np.dtype(code): name for name, code in _TYPES.items()}
_DECOMPRESS: Final[dict[str, Callable[[Any], bytes]]] = {
    "vtkZLibDataCompressor": zlib.decompress,
    "vtkLZMADataCompressor": lzma.decompress,
}


def read(path: Path) -> Volume:
    """The scalars at the points of one piece, or the only array there: text, base64 or raw, plain or compressed.

    VTK counts points from the first of its extent: `origin` is where that one lies.
    """
    from truefield.volume import Volume

    data = path.read_bytes()
    root, appended = _parsed(data)
    image = root.find("ImageData")
    if root.get("type") != "ImageData" or image is None:
        raise FormatError(f"it holds VTK's {root.get('type')}, not ImageData; give an image or a volume")
    pieces = image.findall("Piece")
    if len(pieces) != 1:
        raise FormatError(f"it has {len(pieces)} pieces; save it as one")
    extent = [int(n) for n in _numbers(image, "WholeExtent", 6, "")]
    if [int(n) for n in _numbers(pieces[0], "Extent", 6, "")] != extent:
        raise FormatError("its piece does not fill its whole extent; save it as one")
    low, high = np.array(extent[::2]), np.array(extent[1::2])
    if np.any(high < low):
        raise FormatError(f"its extent {extent} holds no points")
    array = _scalars(pieces[0])
    values = _values(array, root, appended, tuple(int(n) for n in high - low + 1))
    spacing = np.array(_numbers(image, "Spacing", 3, "1 1 1"))
    axes = np.array(_numbers(image, "Direction", 9, "1 0 0 0 1 0 0 0 1")).reshape(3, 3).T
    directions = axes * spacing[:, None]
    origin = np.array(_numbers(image, "Origin", 3, "0 0 0"))
    if low.any():
        origin = origin + low @ directions
    place = {"origin": origin, "directions": directions}
    comment = re.search(rb"<!-- (.*) -->", data[:_NOTED])
    noted = None if comment is None else raw.noted(comment[1].decode("utf-8", "replace"), 3)
    if noted is not None and all(np.allclose(noted[key], place[key], rtol=1e-14, atol=0) for key in place):
        place = noted
    return Volume(values, name=array.get("Name") or raw.stem(path), **place)


def write(volume: Volume, path: Path) -> None:
    """Raw samples, appended, little endian; the array is called as the volume is."""
    values = volume.values.view(np.uint8) if volume.values.dtype == np.bool_ else volume.values
    if values.ndim != 3:
        raise FormatError("a .vti holds volumes; write an image as .nrrd, .npz, .tif or .png")
    if values.dtype not in _NAMES:
        raise FormatError(f"VTK has no samples of {values.dtype}; turn them into float32 first")
    extent = " ".join(f"0 {n - 1}" for n in values.shape)
    axes = volume.axes
    steps = f'Spacing="{_words(volume.spacing)}"'
    noted = ""
    if not np.array_equal(axes, np.eye(3)) or volume.space:
        steps += f' Direction="{_words(axes.T)}"'
        # VTK knows no space, and steps along turned axes are products; what they were is in a comment.
        noted = f"  <!-- {raw.note(volume).replace('--', '- -')} -->\n"
    name = quoteattr(volume.name)
    header = (
        '<?xml version="1.0"?>\n'
        '<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
        f'{noted}  <ImageData WholeExtent="{extent}" Origin="{_words(volume.origin)}" {steps}>\n'
        f'    <Piece Extent="{extent}">\n'
        f"      <PointData Scalars={name}>\n"
        f'        <DataArray type="{_NAMES[values.dtype]}" Name={name} format="appended" offset="0"/>\n'
        "      </PointData>\n    </Piece>\n  </ImageData>\n"
        '  <AppendedData encoding="raw">\n   _'
    )
    with replacing(path) as stream:
        stream.write(header.encode())
        stream.write(np.uint64(values.nbytes).astype("<u8").tobytes())
        raw.put(stream, values)
        stream.write(b"\n  </AppendedData>\n</VTKFile>\n")


def _parsed(data: bytes) -> tuple[ElementTree.Element, tuple[str, bytes]]:
    """The tree without its appended samples; their encoding, and they."""
    appended = ("", b"")
    start = re.search(rb"<AppendedData([^>]*)>\s*_", data[: 1 << 20])
    text = data
    if start is not None:
        end = data.rfind(b"</AppendedData>")
        if end < start.end():
            raise FormatError("it is truncated: its samples do not end; copy it again")
        encoding = "raw" if b'"raw"' in start[1] else "base64"
        appended = (encoding, data[start.end() : end])
        text = data[: start.start()] + data[end + len(b"</AppendedData>") :]
    if b"<!DOCTYPE" in text[: 1 << 20] or b"<!ENTITY" in text:
        raise FormatError("it defines entities, which no VTK file needs")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise FormatError(f"it is no XML ({error}); copy it again") from None
    if root.tag != "VTKFile":
        raise FormatError("it is no VTK file; save it as .vti again")
    return root, appended


def _scalars(piece: ElementTree.Element) -> ElementTree.Element:
    points = piece.find("PointData")
    arrays = [] if points is None else points.findall("DataArray")
    if points is None or not arrays:
        raise FormatError("it has no values at its points (values of cells lie elsewhere); save point data")
    chosen = [a for a in arrays if a.get("Name") == points.get("Scalars")] or (arrays if len(arrays) == 1 else [])
    if not chosen:
        names = ", ".join(str(a.get("Name")) for a in arrays)
        raise FormatError(f"it holds the arrays {names} and does not say which are its scalars")
    if int(chosen[0].get("NumberOfComponents") or 1) != 1:
        raise FormatError("its points hold several values each; give a volume of single values")
    return chosen[0]


def _values(
    array: ElementTree.Element, root: ElementTree.Element, appended: tuple[str, bytes], shape: tuple[int, ...]
) -> NDArray[Any]:
    code = _TYPES.get(array.get("type", ""))
    if code is None:
        raise FormatError(f"its samples are of type '{array.get('type')}'; give single integers or floats")
    order = "<" if root.get("byte_order") != "BigEndian" else ">"
    dtype = np.dtype(order + code)
    count = int(np.prod(shape, dtype=object))
    kind = array.get("format", "ascii")
    if kind == "ascii":
        try:
            values = np.array((array.text or "").split(), dtype=dtype.newbyteorder("="))
        except (ValueError, OverflowError):
            raise FormatError("its text holds words that are no such numbers") from None
    else:
        if kind == "appended":
            encoding, content = appended
            content = content[int(array.get("offset") or 0) :]
        else:
            encoding, content = "base64", (array.text or "").strip().encode()
        header = np.dtype(order + ("u8" if root.get("header_type") == "UInt64" else "u4"))
        try:
            data = _decoded(content, encoding, header, root.get("compressor"))
        except FormatError:
            raise
        except (zlib.error, lzma.LZMAError, binascii.Error, ValueError) as error:
            raise FormatError(f"its samples are damaged ({error}); copy it again") from None
        if len(data) != count * dtype.itemsize:
            raise FormatError(f"it holds {len(data)} bytes of samples, its extent promises {count * dtype.itemsize}")
        values = raw.native(np.frombuffer(bytearray(data) if order == ">" else data, dtype))
    if len(values) != count:
        raise FormatError(f"it holds {len(values)} samples, its extent promises {count}")
    return np.asarray(values.reshape(shape[::-1]).T)


def _decoded(content: bytes, encoding: str, header: np.dtype[Any], compressor: str | None) -> bytes | memoryview:
    """The bytes after a header: their number, or, where compressed, numbers of blocks and their sizes."""

    def head(count: int) -> NDArray[Any]:
        size = count * header.itemsize
        taken = base64.b64decode(content[: -(-size // 3) * 4]) if encoding == "base64" else content[:size]
        if len(taken) < size:
            raise FormatError("it is truncated within its samples; copy it again")
        return np.frombuffer(taken, header, count)

    def body(after: int, size: int) -> bytes | memoryview:
        if encoding == "raw":
            return memoryview(content)[after : after + size]
        return base64.b64decode(content[-(-after // 3) * 4 :])[:size]

    if compressor is None:
        size = int(head(1)[0])
        if encoding == "raw":
            return body(header.itemsize, size)
        # Count and samples are one piece of base64.
        return memoryview(base64.b64decode(content))[header.itemsize : header.itemsize + size]
    if compressor not in _DECOMPRESS:
        raise FormatError(f"it is compressed by {compressor}; save it with zlib or without compression")
    blocks = int(head(1)[0])
    if blocks > len(content):
        raise FormatError("its count of compressed blocks is wrong; it is damaged")
    sizes = head(3 + blocks)[3:].astype(np.int64)
    packed = body((3 + blocks) * header.itemsize, int(sizes.sum()))
    ends = np.cumsum(sizes)
    unpack = _DECOMPRESS[compressor]
    return b"".join(unpack(packed[end - size : end]) for end, size in zip(ends.tolist(), sizes.tolist(), strict=True))


def _numbers(element: ElementTree.Element, key: str, count: int, default: str) -> list[float]:
    text = element.get(key, default)
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not np.all(np.isfinite(numbers)):
        raise FormatError(f"its {key} is '{text}', not {count} numbers")
    return numbers


def _words(numbers: NDArray[np.float64]) -> str:
    return " ".join(repr(float(number)) for number in numbers.reshape(-1))
