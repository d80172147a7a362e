"""PLY, text and binary of both byte orders: the elements `vertex` and `face`, and columns of points."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from typing import IO, TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from truefield.formats.polygons import FormatError, Soup, fan, numbers

if TYPE_CHECKING:
    from truefield.mesh import TriangleMesh

_TYPES: Final = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4"},
    **{"int64": "i8", "uint64": "u8", "double": "f8", "float64": "f8"},
}
_COUNTS: Final = {name: kind for name, kind in _TYPES.items() if kind[0] != "f"}
_NAMES: Final = {
    "i1": "char",
    "u1": "uchar",
    "i2": "short",
    "u2": "ushort",
    "i4": "int",
    "u4": "uint",
    "f4": "float",
    "f8": "double",
}
_ORDERS: Final = {"binary_little_endian": "<", "binary_big_endian": ">"}
_ROWS: Final = 65_536
_CORNERS: Final = ("vertex_indices", "vertex_index")


class _Property(NamedTuple):
    name: str
    kind: str
    count_kind: str | None  # the type of a list's length; None: one number


class _Element(NamedTuple):
    name: str
    rows: int
    properties: list[_Property]


class _Lists(NamedTuple):
    """A column of lists: their lengths, and all their items one after another."""

    sizes: NDArray[np.int64]
    items: NDArray[Any]


_Table = dict[str, NDArray[np.float64] | _Lists]


def decode(data: bytes) -> Soup:
    """Reads positions and polygons; polygons become fans, colours, normals and the rest are passed over."""
    tables = _tables(data)
    faces = tables.get("face", {})
    lists = next((column for name in _CORNERS if isinstance(column := faces.get(name), _Lists)), None)
    if lists is None:
        if "tristrips" in tables:
            raise FormatError("it stores its triangles as strips; export it with plain faces")
        lists = _Lists(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
    if (lists.sizes < 3).any():
        index = int(np.argmax(lists.sizes < 3))
        raise FormatError(f"face {index} has {lists.sizes[index]} corners; a face needs 3 or more")
    return Soup(_positions(tables), fan(_indices(lists.items), lists.sizes))


def decode_points(data: bytes) -> NDArray[np.float64]:
    """The positions (n, 3) of the element `vertex`."""
    return _positions(_tables(data))


def _positions(tables: dict[str, _Table]) -> NDArray[np.float64]:
    columns = [tables.get("vertex", {}).get(axis) for axis in "xyz"]
    arrays = [column for column in columns if isinstance(column, np.ndarray)]
    if len(arrays) != 3:
        raise FormatError("it has no element 'vertex' with x, y and z")
    return np.stack(arrays, axis=1)


def _tables(data: bytes) -> dict[str, _Table]:
    order, elements, body = _header(data)
    tables: dict[str, _Table] = {}
    at = 0
    if order is None:
        tokens = body.split()
        for element in elements:
            tables[element.name], at = _text_table(element, tokens, at)
        rest = len(tokens) - at
    else:
        for element in elements:
            tables[element.name], at = _binary_table(element, body, at, order)
        rest = len(body[at:].strip())
    if rest:
        raise FormatError(
            f"it goes on after the last element it declares ({rest} {'bytes' if order else 'numbers'} more)"
        )
    return tables


def _header(data: bytes) -> tuple[str | None, list[_Element], bytes]:
    if not data.startswith((b"ply\n", b"ply\r")):
        raise FormatError("it does not begin with 'ply', so it is no PLY")
    end = data.find(b"end_header")
    if end < 0:
        raise FormatError("its header has no 'end_header'; the file is truncated or no PLY")
    # The body begins after one line break; a lone carriage return is one only where the header uses it too.
    after = end + len(b"end_header")
    after += 2 if data[after : after + 2] == b"\r\n" else 1
    order: str | None = ""
    elements: list[_Element] = []
    for line in data[:end].decode("utf-8", "replace").splitlines()[1:]:
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = None if words[1] == "ascii" else _ORDERS[words[1]]
            elif words[:1] == ["element"]:
                _, name, rows = words
                elements.append(_Element(name, int(rows), []))
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append(_Property(words[4], _TYPES[words[3]], _COUNTS[words[2]]))
            elif words[:1] == ["property"]:
                elements[-1].properties.append(_Property(words[2], _TYPES[words[1]], None))
        except (IndexError, KeyError, ValueError):
            raise FormatError(f"its header line {line.strip()!r} makes no sense") from None
    if order == "":
        raise FormatError("its header has no 'format' line")
    if any(element.rows < 0 for element in elements):
        raise FormatError("its header declares a negative count")
    return order, elements, data[after:]


def _text_table(element: _Element, tokens: list[bytes], at: int) -> tuple[_Table, int]:
    lists = [column for column in element.properties if column.count_kind]
    width = len(element.properties)
    if not lists:
        end = at + element.rows * width
        _enough(element, len(tokens) >= end)
        grid = numbers(tokens[at:end], f"element '{element.name}'").reshape(element.rows, width)
        return {column.name: grid[:, i] for i, column in enumerate(element.properties)}, end
    scalars: dict[str, list[bytes]] = {column.name: [] for column in element.properties}
    sizes: dict[str, list[int]] = {column.name: [] for column in lists}
    for _ in range(element.rows):
        for column in element.properties:
            _enough(element, at < len(tokens))
            size = 1
            if column.count_kind:
                size = _size(element, tokens[at])
                sizes[column.name].append(size)
                at += 1
            _enough(element, at + size <= len(tokens))
            scalars[column.name] += tokens[at : at + size]
            at += size
    table: _Table = {}
    for column in element.properties:
        values = numbers(scalars[column.name], f"'{column.name}' of element '{element.name}'")
        table[column.name] = _lists(sizes[column.name], values) if column.count_kind else values
    return table, at


def _binary_table(element: _Element, body: bytes, at: int, order: str) -> tuple[_Table, int]:
    if element.rows == 0:
        return {}, at
    # Nearly always all lists of a column are as long as the first: then a row is a fixed record.
    lengths = _row_lengths(element, body, at, order)
    record = np.dtype(
        [
            field
            for i, (column, length) in enumerate(zip(element.properties, lengths, strict=True))
            for field in (
                [(f"count{i}", order + column.count_kind), (f"value{i}", order + column.kind, (length,))]
                if column.count_kind
                else [(f"value{i}", order + column.kind)]
            )
        ]
    )
    end = at + element.rows * record.itemsize
    if len(body) >= end:
        rows = np.frombuffer(body, dtype=record, count=element.rows, offset=at)
        if all(
            (rows[f"count{i}"] == lengths[i]).all() for i, column in enumerate(element.properties) if column.count_kind
        ):
            table: _Table = {}
            for i, column in enumerate(element.properties):
                values = rows[f"value{i}"]
                if column.count_kind:
                    table[column.name] = _lists([lengths[i]] * element.rows, values.reshape(-1))
                else:
                    table[column.name] = values.astype(np.float64)
            return table, end
    _enough(element, any(column.count_kind for column in element.properties))
    return _walk(element, body, at, order)


def _row_lengths(element: _Element, body: bytes, at: int, order: str) -> list[int]:
    lengths = []
    for column in element.properties:
        size = 1
        if column.count_kind:
            after = at + int(column.count_kind[1])
            _enough(element, after <= len(body))
            size = int.from_bytes(body[at:after], "little" if order == "<" else "big")
            at = after
        lengths.append(size)
        at += size * int(column.kind[1])
        _enough(element, at <= len(body))
    return lengths


def _walk(element: _Element, body: bytes, at: int, order: str) -> tuple[_Table, int]:
    parts: dict[str, list[bytes]] = {column.name: [] for column in element.properties}
    sizes: dict[str, list[int]] = {column.name: [] for column in element.properties}
    for _ in range(element.rows):
        for column, length in zip(element.properties, _row_lengths(element, body, at, order), strict=True):
            at += int(column.count_kind[1]) if column.count_kind else 0
            end = at + length * int(column.kind[1])
            parts[column.name].append(body[at:end])
            sizes[column.name].append(length)
            at = end
    table: _Table = {}
    for column in element.properties:
        values = np.frombuffer(b"".join(parts[column.name]), dtype=order + column.kind)
        table[column.name] = _lists(sizes[column.name], values) if column.count_kind else values.astype(np.float64)
    return table, at


def _lists(sizes: list[int], values: NDArray[Any]) -> _Lists:
    return _Lists(np.array(sizes, dtype=np.int64), values)


def _indices(items: NDArray[Any]) -> NDArray[np.int64]:
    with np.errstate(invalid="ignore"):
        whole = items.astype(np.int64)
    if not np.array_equal(whole, items):
        raise FormatError("a face's list of vertices holds something that is no whole number")
    return whole


def _size(element: _Element, token: bytes) -> int:
    if not token.isdigit():
        shown = token.decode(errors="replace")
        raise FormatError(f"element '{element.name}' holds {shown!r} where the length of a list should be")
    return int(token)


def _enough(element: _Element, enough: bool) -> None:
    if not enough:
        raise FormatError(f"it is truncated: it ends within the {element.rows} elements '{element.name}' it declares")


def encode(mesh: TriangleMesh, scalars: Mapping[str, NDArray[np.generic]] | None = None) -> bytes:
    """Binary little endian, double vertices with `scalars`, uchar-counted faces with unsigned indices."""
    faces = np.empty(len(mesh.triangles), dtype=[("count", "u1"), ("corners", "<u4", 3)])
    faces["count"] = 3
    faces["corners"] = mesh.triangles
    header = f"element face {len(faces)}\nproperty list uchar uint vertex_indices\n"
    return encode_points(dict(zip("xyz", mesh.vertices.T, strict=True)) | dict(scalars or {}), header) + faces.tobytes()


def encode_points(columns: Mapping[str, NDArray[np.generic]], further: str = "") -> bytes:
    """What `write_points` writes; `further` ends the header."""
    stream = BytesIO()
    _write(stream, columns, further)
    return stream.getvalue()


def write_points(stream: IO[bytes], columns: Mapping[str, NDArray[np.generic]]) -> None:
    """Binary little endian PLY whose element `vertex` has these columns, in order, written piece by piece.

    Whole numbers are stored as `int` or `uint` at most, since few readers know wider ones.
    """
    _write(stream, columns, "")


def _write(stream: IO[bytes], columns: Mapping[str, NDArray[np.generic]], further: str) -> None:
    kinds = {name: _kind(name, column) for name, column in columns.items()}
    count = len(next(iter(columns.values())))
    properties = "".join(f"property {_NAMES[kind]} {name}\n" for name, kind in kinds.items())
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {count}\n{properties}{further}end_header\n"
    stream.write(header.encode("ascii"))
    row = np.dtype([(name, "<" + kind) for name, kind in kinds.items()])
    for first in range(0, count, _ROWS):
        rows = np.empty(min(_ROWS, count - first), dtype=row)
        for name, column in columns.items():
            rows[name] = column[first : first + _ROWS]
        stream.write(rows.tobytes())


def _kind(name: str, column: NDArray[np.generic]) -> str:
    kind = column.dtype.kind + str(column.dtype.itemsize)
    if kind in _NAMES:
        return kind
    if column.dtype.kind == "f":
        return "f8" if column.dtype.itemsize > 4 else "f4"
    for narrow in ("i4", "u4"):
        if np.array_equal(column, column.astype(narrow)):
            return narrow
    raise FormatError(f"{name} holds whole numbers beyond 32 bits, which PLY cannot store")
