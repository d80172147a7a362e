"""Points as text tables and numpy files."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from typing import IO, Final

import numpy as np
from numpy.typing import NDArray

from truefield.formats.polygons import FormatError, numbers, reason

_ROWS: Final = 65_536


def decode_text(data: bytes) -> NDArray[np.float64]:
    """One point a line; columns x, y and z where the first line names them, else the first three."""
    if b"\0" in data:
        raise FormatError("it holds zero bytes, so it is no text")
    separator = next((mark for mark in (b";", b",") if mark in data), None)
    rows: list[tuple[int, list[bytes]]] = []
    for number, line in enumerate(data.removeprefix(b"\xef\xbb\xbf").splitlines(), start=1):
        text = line.partition(b"#")[0].strip()
        if text:
            rows.append((number, [cell.strip() for cell in text.split(separator)]))
    columns = [0, 1, 2]
    if rows and not _is_number(rows[0][1][0]):
        names = [name.strip(b"\"'").lower() for name in rows.pop(0)[1]]
        if not {b"x", b"y", b"z"} <= set(names):
            raise FormatError("its first line names columns, but not x, y and z")
        columns = [names.index(axis) for axis in (b"x", b"y", b"z")]
    cells: list[bytes] = []
    for number, row in rows:
        if len(row) <= max(columns):
            raise FormatError(f"line {number} has {len(row)} columns; a point needs x, y and z")
        cells += [row[column] for column in columns]
    try:
        return numbers(cells, "a point").reshape(-1, 3)
    except FormatError:
        for number, row in rows:
            numbers([row[column] for column in columns], f"line {number}")
        raise


def decode_npy(data: bytes) -> NDArray[np.float64]:
    """A numpy array file of shape (n, 3)."""
    try:
        array = np.load(BytesIO(data), allow_pickle=False)
    except Exception as error:  # numpy lets out whatever its header parser stumbles over
        raise FormatError(f"it is damaged or no numpy array file ({reason(error)})") from None
    if not isinstance(array, np.ndarray) or array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in "iuf":
        shape = getattr(array, "shape", None)
        raise FormatError(
            f"its array has shape {shape} and dtype {getattr(array, 'dtype', None)}; give real numbers (n, 3)"
        )
    return np.ascontiguousarray(array, dtype=np.float64)


def encode_rows(stream: IO[bytes], columns: Mapping[str, NDArray[np.generic]], separator: str) -> None:
    """Writes the columns side by side, a line a row, in shortest decimals that read back as the same float64."""
    count = len(next(iter(columns.values())))
    for first in range(0, count, _ROWS):
        cells = [map(repr, column[first : first + _ROWS].tolist()) for column in columns.values()]
        stream.write("".join(separator.join(row) + "\n" for row in zip(*cells, strict=True)).encode("ascii"))


def _is_number(cell: bytes) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
