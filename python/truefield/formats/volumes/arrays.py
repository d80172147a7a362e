"""NumPy's own files: `.npy`, samples alone, and `.npz` with origin, directions and space."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from truefield.files import replacing
from truefield.formats.polygons import FormatError
from truefield.formats.volumes import raw

if TYPE_CHECKING:
    from truefield.volume import Volume


def read_npy(path: Path) -> Volume:
    """An array, indexed [x, y, z]."""
    from truefield.volume import Volume

    array = _load(path)
    if not isinstance(array, np.ndarray):
        raise FormatError("it is an archive of arrays; call it .npz")
    return Volume(array, name=raw.stem(path))


def write_npy(volume: Volume, path: Path) -> None:
    """The samples alone."""
    if not raw.is_plain(volume):
        raise FormatError("an .npy holds no origin, spacing and axes; write .npz")
    with replacing(path) as stream:
        np.save(stream, volume.values)


def read_npz(path: Path) -> Volume:
    """The array `values`, or the only one; `origin`, `directions` (or `spacing`) and `space` if they are there."""
    from truefield.volume import Volume

    content = _load(path)
    if not isinstance(content, np.lib.npyio.NpzFile):
        raise FormatError("it is a single array; call it .npy")
    with content:
        try:
            names = list(content.files)
            key = "values" if "values" in names else names[0]
            if key != "values" and len(names) > 1:
                raise FormatError(f"it holds the arrays {', '.join(names)}; call the samples 'values'")
            found = {name: content[name] for name in (key, "origin", "spacing", "directions", "space") if name in names}
        except FormatError:
            raise
        except Exception as error:  # what zip files and arrays raise when damaged has no common base
            raise FormatError(f"it is no archive of arrays ({_said(error)}); write it again with numpy") from None
    place: dict[str, Any] = {name: array for name, array in found.items() if name != key}
    if "space" in place:
        place["space"] = str(place["space"])
    return Volume(found[key], name=raw.stem(path), **place)


def write_npz(volume: Volume, path: Path) -> None:
    """The arrays `values`, `origin`, `directions` and `space`, not compressed."""
    place = {"origin": volume.origin, "directions": volume.directions, "space": np.array(volume.space)}
    with replacing(path) as stream:
        np.savez(stream, values=volume.values, **place)  # type: ignore[arg-type]


def _load(path: Path) -> Any:
    try:
        return np.load(path, allow_pickle=False)
    except OSError:
        raise
    except Exception as error:  # as above
        raise FormatError(f"it is no array of numbers ({_said(error)}); save it with numpy") from None


def _said(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
