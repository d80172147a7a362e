"""File formats of volumes: one file per format, `read` and `write`.

Files index their samples with x fastest, arrays here with x first: reading makes a transposed view, never a copy.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from truefield.errors import FileError
from truefield.formats.volumes import arrays, images, nifti, nrrd, tiff, vti, zarr

if TYPE_CHECKING:
    from truefield.volume import Volume

_READERS: Final[dict[str, Callable[[Path], Volume]]] = {
    ".nrrd": nrrd.read,
    ".nii": nifti.read,
    ".nii.gz": nifti.read,
    ".vti": vti.read,
    ".npy": arrays.read_npy,
    ".npz": arrays.read_npz,
    ".tif": images.read,
    ".tiff": images.read,
    ".png": images.read,
    ".zarr": zarr.read,
}
_WRITERS: Final[dict[str, Callable[[Volume, Path], None]]] = {
    ".nrrd": nrrd.write,
    ".nii": nifti.write,
    ".nii.gz": nifti.write,
    ".vti": vti.write,
    ".npy": arrays.write_npy,
    ".npz": arrays.write_npz,
    ".tif": tiff.write,
    ".tiff": tiff.write,
    ".png": images.write_png,
    ".zarr": zarr.write,
}
SUFFIXES: Final = tuple(_READERS)


def suffix_of(path: Path) -> str:
    """The suffix in small letters, `.nii.gz` being one."""
    name = path.name.lower()
    return ".nii.gz" if name.endswith(".nii.gz") else path.suffix.lower()


def read(path: Path) -> Volume:
    """The volume in a file, of the format that its suffix names."""
    suffix = suffix_of(path)
    if not path.exists():
        raise FileError(f"cannot read '{path}': there is no such file; check the name")
    if suffix not in _READERS:
        raise FileError(f"cannot read '{path}': a volume is one of {', '.join(SUFFIXES)}")
    if path.is_dir() and suffix != ".zarr":
        raise FileError(f"cannot read '{path}': it is a folder; give the name of a file")
    try:
        return _READERS[suffix](path)
    except FileError:
        raise
    except EOFError:
        raise FileError(f"cannot read '{path}': it ends too early; copy it again") from None
    except OSError as error:
        raise FileError(f"cannot read '{path}': {(error.strerror or str(error)).lower()}") from None


def write(volume: Volume, path: Path) -> None:
    """Writes a volume in the format that the suffix of `path` names."""
    _WRITERS[suffix_of(path)](volume, path)
