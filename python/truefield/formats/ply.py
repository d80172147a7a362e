"""PLY, text and binary of both byte orders: the elements `vertex` and `face`, and columns of points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import IO, TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from truefield.files import size_of
from truefield.formats.polygons import Column, FormatError, Soup, fan, numbers, pieces

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
_START: Final = 1 << 16  # bytes in which headers and rows nearly always end
_END: Final = b"end_header"
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


def decode(stream: IO[bytes]) -> Soup:
    """Reads positions and polygons; polygons become fans, colours, normals and the rest are passed over."""
    tables = _tables(stream)
    faces = tables.get("face", {})
    lists = next((column for name in _CORNERS if isinstance(column := faces.get(name), _Lists)), None)
    if lists is None:
        if "tristrips" in tables:
            raise FormatError("it stores its triangles as strips; export it with plain faces")
        lists = _Lists(np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64))
    if (lists.sizes < 3).any():
        index = int(np.argmax(lists.sizes < 3))
        raise FormatError(f"face {index} has {lists.sizes[index]} corners; a face needs 3 or more")
    return Soup(_positions(tables), fan(lists.items, lists.sizes))


def decode_points(stream: IO[bytes]) -> NDArray[np.float64]:
    """The positions (n, 3) of the element `vertex`."""
    return _positions(_tables(stream))


def _positions(tables: dict[str, _Table]) -> NDArray[np.float64]:
    columns = [tables.get("vertex", {}).get(axis) for axis in "xyz"]
    arrays = [column for column in columns if isinstance(column, np.ndarray)]
    if len(arrays) != 3:
        raise FormatError("it has no element 'vertex' with x, y and z")
    return np.stack(arrays, axis=1)


def _tables(stream: IO[bytes]) -> dict[str, _Table]:
    """What is wanted of each element: positions and corners."""
    order, elements = _header(stream)
    tables: dict[str, _Table] = {}
    if order is None:
        tokens = _Tokens(stream)
        for element in elements:
            tables[element.name] = _table(element, _text_parts(element, tokens))
        rest = tokens.left()
    else:
        for element in elements:
            tables[element.name] = _table(element, _binary_parts(element, stream, order))
        rest = len(stream.read().strip())
    if rest:
        raise FormatError(
            f"it goes on after the last element it declares ({rest} {'bytes' if order else 'numbers'} more)"
        )
    return tables


class _Tokens:
    """The words of a text, some at a time."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._pieces = pieces(stream)
        self._words: list[bytes] = []
        self._at = 0

    def take(self, count: int) -> list[bytes]:
        """The next words: fewer where the text ends."""
        if self._at + count > len(self._words):
            self._words = self._words[self._at :]
            self._at = 0
            while len(self._words) < count and (piece := next(self._pieces, None)) is not None:
                self._words += piece.split()
        taken = self._words[self._at : self._at + count]
        self._at += len(taken)
        return taken

    def left(self) -> int:
        """How many words there are still."""
        return len(self._words) - self._at + sum(len(piece.split()) for piece in self._pieces)


def _header(stream: IO[bytes]) -> tuple[str | None, list[_Element]]:
    """The order of bytes, `None` for text, and the elements; leaves the stream where the body begins."""
    start, data = stream.tell(), stream.read(_START)
    if not data.startswith((b"ply\n", b"ply\r")):
        raise FormatError("it does not begin with 'ply', so it is no PLY")
    # The line break belongs to it. Pieces double, so that long files are not copied again and again.
    while ((end := data.find(_END)) < 0 or len(data) < end + len(_END) + 2) and (more := stream.read(len(data))):
        data += more
    if end < 0:
        raise FormatError("its header has no 'end_header'; the file is truncated or no PLY")
    # The body begins after one line break; a lone carriage return is one only where the header uses it too.
    after = end + len(_END)
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
    stream.seek(start + after)
    return order, elements


def _table(element: _Element, parts: Iterator[_Table]) -> _Table:
    """The columns that are looked at, of all rows; the others are only read."""
    wanted = {"vertex": ("x", "y", "z"), "face": _CORNERS}.get(element.name, ())
    columns = [column for column in element.properties if column.name in wanted]
    values = {column.name: Column(np.float64) for column in columns if not column.count_kind}
    sizes = {column.name: Column(np.int64) for column in columns if column.count_kind}
    items = {name: Column(np.int64) for name in sizes}
    for part in parts:
        for name, column in part.items():
            if not isinstance(column, _Lists):
                if name in values:
                    values[name].add(column)
            elif name in sizes:
                sizes[name].add(column.sizes)
                items[name].add(_indices(column.items))
    scalars: _Table = {name: column.array() for name, column in values.items()}
    return scalars | {name: _Lists(sizes[name].array(), items[name].array()) for name in sizes}


def _text_parts(element: _Element, tokens: _Tokens) -> Iterator[_Table]:
    lists = any(column.count_kind for column in element.properties)
    width = len(element.properties)
    for first in range(0, element.rows, _ROWS):
        rows = min(_ROWS, element.rows - first)
        if lists:
            yield _text_lists(element, rows, tokens)
            continue
        words = tokens.take(rows * width)
        _enough(element, len(words) == rows * width)
        grid = numbers(words, f"element '{element.name}'").reshape(rows, width)
        yield {column.name: grid[:, i] for i, column in enumerate(element.properties)}


def _text_lists(element: _Element, rows: int, tokens: _Tokens) -> _Table:
    words: dict[str, list[bytes]] = {column.name: [] for column in element.properties}
    sizes: dict[str, list[int]] = {column.name: [] for column in element.properties if column.count_kind}
    for _ in range(rows):
        for column in element.properties:
            size = 1
            if column.count_kind:
                length = tokens.take(1)
                _enough(element, len(length) == 1)
                size = _size(element, length[0])
                sizes[column.name].append(size)
            taken = tokens.take(size)
            _enough(element, len(taken) == size)
            words[column.name] += taken
    table: _Table = {}
    for column in element.properties:
        values = numbers(words[column.name], f"'{column.name}' of element '{element.name}'")
        table[column.name] = _lists(sizes[column.name], values) if column.count_kind else values
    return table


def _binary_parts(element: _Element, stream: IO[bytes], order: str) -> Iterator[_Table]:
    if element.rows == 0:
        return
    # Nearly always all lists of a column are as long as the first: then a row is a fixed record.
    lengths = _first_lengths(element, stream, order)
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
    lists = [i for i, column in enumerate(element.properties) if column.count_kind]
    for first in range(0, element.rows if element.properties else 0, _ROWS):
        count = min(_ROWS, element.rows - first)
        at = stream.tell()
        # Asking for more than there is would make room for it: rows of long lists may be of any size.
        whole = count * record.itemsize <= size_of(stream) - at
        _enough(element, whole or bool(lists))
        rows = np.frombuffer(stream.read(count * record.itemsize), dtype=record) if whole else None
        if rows is None or not all((rows[f"count{i}"] == lengths[i]).all() for i in lists):
            stream.seek(at)
            yield from _walk(element._replace(rows=element.rows - first), stream, order)
            return
        table: _Table = {}
        for i, column in enumerate(element.properties):
            values = rows[f"value{i}"]
            if column.count_kind:
                table[column.name] = _Lists(np.full(count, lengths[i]), values.reshape(-1))
            else:
                table[column.name] = values.astype(np.float64)
        yield table


def _first_lengths(element: _Element, stream: IO[bytes], order: str) -> list[int]:
    """The lengths of the first row's columns; the stream stays where it is."""
    at = stream.tell()
    start = stream.read(_START)
    try:
        return _row_lengths(element, start, 0, order)
    except FormatError:
        return _row_lengths(element, start + stream.read(), 0, order)
    finally:
        stream.seek(at)


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


def _walk(element: _Element, stream: IO[bytes], order: str) -> Iterator[_Table]:
    """Rows of any length, one after another; leaves the stream behind the last."""
    start, at = stream.tell(), 0
    body = stream.read()
    for first in range(0, element.rows, _ROWS):
        parts: dict[str, list[bytes]] = {column.name: [] for column in element.properties}
        sizes: dict[str, list[int]] = {column.name: [] for column in element.properties}
        for _ in range(min(_ROWS, element.rows - first)):
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
        yield table
    stream.seek(start + at)


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


def encode(mesh: TriangleMesh, stream: IO[bytes], scalars: Mapping[str, NDArray[np.generic]] | None = None) -> None:
    """Binary little endian, double vertices with `scalars`, uchar-counted faces with unsigned indices."""
    header = f"element face {len(mesh.triangles)}\nproperty list uchar uint vertex_indices\n"
    _write(stream, dict(zip("xyz", mesh.vertices.T, strict=True)) | dict(scalars or {}), header)
    for first in range(0, len(mesh.triangles), _ROWS):
        part = mesh.triangles[first : first + _ROWS]
        faces = np.empty(len(part), dtype=[("count", "u1"), ("corners", "<u4", 3)])
        faces["count"], faces["corners"] = 3, part
        stream.write(faces.data)


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
        stream.write(rows.data)


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
