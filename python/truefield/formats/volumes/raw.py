"""Samples as bytes, x fastest, and notes for formats that cannot say where they lie."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from truefield.formats.polygons import FormatError

if TYPE_CHECKING:
    from truefield.volume import Volume

# Compressed in a tenth of a second or two, so that Ctrl-C is heard in time.
_CHUNK: Final = 1 << 22
_NOTE: Final = "truefield"


def stem(path: Path) -> str:
    """The file's name without its suffixes."""
    name = path.name
    return name[: -len(".nii.gz")] if name.lower().endswith(".nii.gz") else path.stem


def samples(stream: IO[bytes], dtype: np.dtype[Any], shape: Sequence[int]) -> NDArray[Any]:
    """The next samples of a stream, indexed [x, y, z]; refuses a stream that ends before the last."""
    count = int(np.prod([int(n) for n in shape], dtype=object))
    try:
        array = np.empty(count, dtype)
    except (MemoryError, ValueError, OverflowError):
        raise FormatError(f"its {count} samples do not fit into memory; cut out a part of it") from None
    view = array.view(np.uint8).data
    done = 0
    while done < len(view):
        got = stream.readinto(view[done : done + _CHUNK])  # type: ignore[attr-defined]
        if not got:
            raise FormatError(
                f"it is truncated: its header promises {len(view)} bytes of samples, it has {done}; copy it again"
            )
        done += got
    ordered: NDArray[Any] = native(array).reshape(tuple(shape)[::-1]).T
    return ordered


def finished(stream: IO[bytes]) -> None:
    """Refuses a stream that holds more than its header says."""
    if stream.read(1):
        raise FormatError("it holds more samples than its header says; the header is wrong")


def native(array: NDArray[Any]) -> NDArray[Any]:
    """The same numbers in this machine's byte order."""
    if array.dtype.isnative:
        return array
    swapped: NDArray[Any] = array.byteswap(inplace=True).view(array.dtype.newbyteorder("="))
    return swapped


def put(stream: IO[bytes], values: NDArray[Any]) -> None:
    """Writes samples little endian, x fastest, a part at a time."""
    turned = values.T
    rows = max(1, _CHUNK // max(1, turned[0].nbytes))
    little = values.dtype.newbyteorder("<")
    for start in range(0, len(turned), rows):
        part = np.ascontiguousarray(turned[start : start + rows], dtype=little)
        stream.write(part.reshape(-1).view(np.uint8).data)


def note(volume: Volume) -> str:
    """Where the samples lie, in one line of JSON that gives the same floats again."""
    place = {"origin": volume.origin.tolist(), "directions": volume.directions.tolist(), "space": volume.space}
    return json.dumps({_NOTE: place})


def noted(text: str, axes: int) -> dict[str, Any] | None:
    """The arguments of a Volume that a note holds; None if the text is no note, or one of another shape."""
    try:
        place = json.loads(text)[_NOTE]
        origin = np.asarray(place["origin"], dtype=np.float64)
        directions = np.asarray(place["directions"], dtype=np.float64)
        space = str(place["space"])
    except (ValueError, KeyError, TypeError):
        return None
    if origin.shape != (axes,) or directions.shape != (axes, axes):
        return None
    return {"origin": origin, "directions": directions, "space": space}


def is_plain(volume: Volume) -> bool:
    """Whether the volume lies where a file that says nothing puts it."""
    plain = not volume.origin.any() and np.array_equal(volume.directions, np.eye(len(volume.origin)))
    return plain and not volume.space
