"""Zarr: a folder of blocks, by way of the package zarr where it is installed."""

from __future__ import annotations

import importlib
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from truefield.files import replacing_folder
from truefield.formats.polygons import FormatError
from truefield.formats.volumes import raw

if TYPE_CHECKING:
    from truefield.volume import Volume

_BLOCK: Final = 64
_KEY: Final = "truefield"


def read(path: Path) -> Volume:
    """An array indexed [x, y, z], all of it; its attribute `truefield` holds origin, directions and space."""
    from truefield.volume import Volume

    try:
        array = _package().open_array(str(path), mode="r")
        values = np.asarray(array[...])
        note = dict(array.attrs).get(_KEY)
    except FormatError:
        raise
    except Exception as error:  # zarr's own errors have no common base
        reason = " ".join(str(error).split()) or type(error).__name__
        raise FormatError(f"zarr says '{reason}'; give the folder of one array") from None
    place: dict[str, Any] = {}
    if isinstance(note, dict):
        place = {key: note[key] for key in ("origin", "directions", "space") if key in note}
    return Volume(values, name=raw.stem(path), **place)


def write(volume: Volume, path: Path) -> None:
    """Blocks of 64 samples a side, with zarr's default compression."""
    package = _package()
    if path.exists():
        raise FormatError("it is there already, and a folder is not replaced; remove it first")
    values = volume.values
    place = {"origin": volume.origin.tolist(), "directions": volume.directions.tolist(), "space": volume.space}
    with replacing_folder(path) as folder:
        blocks = tuple(min(_BLOCK, n) for n in values.shape)
        array = package.create_array(str(folder), shape=values.shape, chunks=blocks, dtype=values.dtype, overwrite=True)
        array.attrs[_KEY] = place
        for x in range(math.ceil(values.shape[0] / _BLOCK)):
            rows = slice(x * _BLOCK, (x + 1) * _BLOCK)
            array[rows] = values[rows]


def _package() -> Any:
    try:
        return importlib.import_module("zarr")
    except ImportError:
        raise FormatError("Zarr needs the package zarr, version 3; install it with 'pip install zarr'") from None
