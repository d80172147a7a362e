"""Columns of numbers, one row a point, as files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from truefield.errors import FileError, TruefieldError
from truefield.files import PathLike, replacing
from truefield.formats import ply, points
from truefield.formats.polygons import FormatError

SUFFIXES: Final = (".ply", ".csv", ".xyz")
_PLAIN: Final = ("x", "y", "z", "nx", "ny", "nz")


def check(path: PathLike) -> None:
    """Raises `FileError` if the suffix of `path` names no format of tables."""
    if Path(path).suffix.lower() not in SUFFIXES:
        raise FileError(f"cannot write points to '{path}': its suffix must be one of {', '.join(SUFFIXES)}")


def write(path: PathLike, columns: Mapping[str, NDArray[np.generic]]) -> None:
    """Writes columns of equal length; the file appears whole or not at all.

    `.ply` binary little endian, element `vertex`; `.csv` with a line of names; `.xyz` blanks between, without names,
    positions and normals only.
    """
    check(path)
    suffix = Path(path).suffix.lower()
    with replacing(path) as stream:
        if suffix == ".ply":
            try:
                ply.write_points(stream, columns)
            except FormatError as error:
                raise TruefieldError(f"cannot write '{path}': {error}; write .csv") from None
        elif suffix == ".csv":
            stream.write(",".join(columns).encode() + b"\n")
            points.encode_rows(stream, columns, ",")
        else:
            points.encode_rows(stream, {name: column for name, column in columns.items() if name in _PLAIN}, " ")
