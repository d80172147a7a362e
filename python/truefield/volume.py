"""Volumes: samples in rows, with their place in space, from and to the files of scanners and simulations."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield.arguments import Floats
from truefield.errors import FileError, TruefieldError
from truefield.files import PathLike, check_file
from truefield.formats.polygons import FormatError

Samples = NDArray[Any]

_STRAIGHT: Final = 1e-12


class Volume:
    """Samples on a lattice in space: of a scan, an image, or a field.

    Node-centred, x first: sample [i, j] lies at `origin + i * directions[0] + j * directions[1]`, and so on.
    An image has two axes: x to the right, and y in the order of its rows.

    Args:
        values: (x, y, z) or (x, y), of booleans, integers or floats; kept as they are, not copied.
        origin: (d,) position of the first sample, model units; zero by default.
        spacing: distance of neighbouring samples along each axis, (d,) or one number, model units; one by default.
        directions: instead of spacing, (d, d): row i is the step from a sample to the next along axis i, so that axes
            may be turned.
        space: what the file says of its coordinates, such as "LPS" (to the patient's left, back and head) or "RAS";
            empty where it says nothing.
        name: what messages call it.

    Raises:
        TruefieldError: the arrays do not fit together, or the axes span no volume.
    """

    __slots__ = ("_directions", "_name", "_origin", "_space", "_values")

    def __init__(
        self,
        values: ArrayLike,
        origin: ArrayLike | None = None,
        spacing: ArrayLike | None = None,
        *,
        directions: ArrayLike | None = None,
        space: str = "",
        name: str = "volume",
    ) -> None:
        """Checks the arrays."""
        samples = np.asarray(values)
        if samples.dtype.kind not in "biuf":
            raise TruefieldError(f"values are of type {samples.dtype}; give booleans, integers or floats")
        if samples.ndim not in (2, 3) or samples.size == 0:
            raise TruefieldError(f"values have shape {samples.shape}; give an array of shape (x, y, z) or (x, y)")
        axes = samples.ndim
        if directions is not None and spacing is not None:
            raise TruefieldError("give spacing or directions, not both")
        if directions is None:
            steps = _numbers("spacing", 1.0 if spacing is None else spacing, (axes,))
            if not np.all(steps > 0):
                raise TruefieldError(f"spacing is {steps.tolist()}; give positive lengths in model units")
            directions = np.diag(steps)
        self._directions = _numbers("directions", directions, (axes, axes))
        self._origin = _numbers("origin", 0.0 if origin is None else origin, (axes,))
        with np.errstate(over="ignore", invalid="ignore"):
            turned = np.linalg.det(self.axes)
        if not abs(turned) > 1e-6:
            raise TruefieldError(f"the axes {self._directions.tolist()} span no volume; give independent directions")
        self._values: Samples = samples.view()
        self._values.flags.writeable = False
        self._space, self._name = str(space), str(name)

    @property
    def values(self) -> Samples:
        """(x, y, z) or (x, y) samples, read-only."""
        return self._values

    @property
    def origin(self) -> Floats:
        """(d,) position of the first sample, model units."""
        return self._origin

    @property
    def directions(self) -> Floats:
        """(d, d) row i is the step from a sample to the next along axis i, model units."""
        return self._directions

    @property
    def spacing(self) -> Floats:
        """(d,) distance of neighbouring samples along each axis, model units."""
        alone = np.count_nonzero(self._directions, axis=1) == 1
        steps: Floats = np.where(alone, np.abs(self._directions).max(axis=1), np.linalg.norm(self._directions, axis=1))
        return steps

    @property
    def axes(self) -> Floats:
        """(d, d) row i is the unit vector along axis i."""
        with np.errstate(divide="ignore", invalid="ignore"):
            axes: Floats = self._directions / self.spacing[:, None]
        return axes

    @property
    def straight(self) -> bool:
        """Whether the axes run along x, y and z, each towards larger coordinates."""
        return bool(np.abs(self.axes - np.eye(len(self._origin))).max() <= _STRAIGHT)

    @property
    def space(self) -> str:
        """What the file says of its coordinates, such as "LPS"; empty where it says nothing."""
        return self._space

    @property
    def name(self) -> str:
        """What messages call it."""
        return self._name

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of samples along each axis."""
        return tuple(self._values.shape)

    def holding(self, values: ArrayLike) -> Volume:
        """Other values at the same places.

        Raises:
            TruefieldError: the values have another shape.
        """
        other = Volume(values, self._origin, directions=self._directions, space=self._space, name=self._name)
        if other.shape != self.shape:
            raise TruefieldError(
                f"the values have shape {other.shape}, the volume {self.shape}; give one for each sample"
            )
        return other

    def write(self, path: PathLike) -> None:
        """Writes the volume; the suffix chooses the format. Read again, it is the same.

        `.nrrd`, `.nii`, `.nii.gz` and `.npz` hold images and volumes anywhere in space. `.vti` and `.zarr` too, `.vti`
        volumes only. `.tif` holds a picture for each z, of 8 or 16 bit, 32 bit integers or floats, `.png` an image of
        8 or 16 bit: what their pictures cannot say of space is written beside them, in the description. `.npy` holds
        samples whose place is the default only. `.zarr` needs the package zarr.

        Raises:
            FileError: the suffix is unknown, the format cannot hold the volume, or the file cannot be written.
        """
        from truefield.formats import volumes

        check(path)
        try:
            volumes.write(self, Path(path))
        except FormatError as error:
            raise FileError(f"cannot write '{path}': {error}") from None

    def __repr__(self) -> str:
        """Name, samples and spacing."""
        counts = " x ".join(map(str, self.shape))
        steps = ", ".join(f"{step:.6g}" for step in self.spacing)
        return f"Volume({self._name!r}, {counts} samples of {self._values.dtype}, spacing {steps})"


def read_volume(path: PathLike) -> Volume:
    """Reads an image or volume and its place in space: NRRD, NIfTI, VTI, NPY, NPZ, TIFF, PNG or Zarr, by the suffix.

    Values keep their type and are in memory once. What a file says of its coordinates is in `space`; nothing is turned
    or scaled, but for NIfTI files that hold a scale of their own. Files are read strictly: what does not fit the file's
    own header is refused.

    Raises:
        FileError: the file cannot be read, is truncated or no volume of its format; the sentence says what is wrong.
    """
    from truefield.formats import volumes

    file = Path(path)
    try:
        return volumes.read(file)
    except FormatError as error:
        raise FileError(f"cannot read '{file}': {error}") from None
    except TruefieldError as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"'{file}' is no usable volume: {error}") from None


def check(path: PathLike, like: Volume | None = None) -> None:
    """Raises `FileError` if a volume could not be written to `path`; for asking before a long job.

    With a volume to be `like`, one sample of its type and at its place is written for trial, in another folder.
    """
    from truefield.formats import volumes

    if volumes.suffix_of(Path(path)) not in volumes.SUFFIXES:
        raise FileError(f"cannot write a volume to '{path}': its suffix must be one of {', '.join(volumes.SUFFIXES)}")
    if volumes.suffix_of(Path(path)) != ".zarr":
        check_file(path)
    if like is not None:
        with TemporaryDirectory() as folder:
            trial = Path(folder) / Path(path).name
            one = np.zeros((1,) * len(like.shape), like.values.dtype)
            try:
                Volume(one, like.origin, directions=like.directions, space=like.space).write(trial)
            except FileError as error:
                raise FileError(str(error).replace(str(trial), str(path))) from None


def _numbers(name: str, value: ArrayLike, shape: tuple[int, ...]) -> Floats:
    try:
        array = np.array(np.broadcast_to(np.asarray(value, dtype=np.float64), shape))
    except (TypeError, ValueError):
        said = " ".join(repr(value).split())
        raise TruefieldError(f"{name} is {said:.80}; give numbers of shape {shape}") from None
    if not np.all(np.isfinite(array)):
        raise TruefieldError(f"{name} is {array.tolist()}; give finite numbers")
    array.flags.writeable = False
    return array
