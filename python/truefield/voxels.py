"""Images as the core reads them: values, and where their voxels lie."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield import arguments
from truefield.arguments import Floats
from truefield.errors import TruefieldError

Sampling = float | Sequence[float] | Floats | None
Periodic = bool | Sequence[bool]

# Axes whose cosine is below this are perpendicular: no distance differs by more than single precision resolves.
_PERPENDICULAR = 1e-7


def array(given: ArrayLike) -> NDArray[Any]:
    """An array of numbers with at least one axis."""
    made = np.asarray(given)
    if made.dtype.kind not in "biuf":
        raise TruefieldError(f"the image holds {made.dtype}; give booleans, whole numbers or real numbers")
    if made.ndim == 0:
        raise TruefieldError("the image is a single number; give an array of at least one axis")
    return made


def readable(given: NDArray[Any], labels: bool, fortran: bool) -> tuple[NDArray[Any], bool]:
    """The image as the core reads it, a copy only where it must be, and whether its axes are reversed."""
    if given.dtype.kind == "f" and given.itemsize not in (4, 8):
        given = given.astype(np.float64)
    given = given.astype(given.dtype.newbyteorder("="), copy=False)
    turned = fortran and given.flags.f_contiguous and not given.flags.c_contiguous
    given = given.T if turned else np.ascontiguousarray(given)
    if labels and (given.itemsize == 8 or given.dtype.kind == "f"):
        given = _numbered(given)
    if given.dtype.kind in "bi":
        given = given.view(f"u{given.itemsize}")
    return given, turned


def _numbered(labels: NDArray[Any]) -> NDArray[np.uint32]:
    """Labels of any kind as small numbers; zero stays zero, as that is what a border may be."""
    if labels.dtype.kind == "f" and np.isnan(labels).any():
        raise TruefieldError("the image holds values that are not a number; they are no labels")
    values = np.unique(labels)
    values = values[values != 0]
    numbers = np.searchsorted(values, labels) + 1
    return np.where(labels == 0, 0, numbers).astype(np.uint32)


def placement(sampling: Sampling, affine: ArrayLike | None, axes: int) -> list[float] | Floats:
    """The distance of neighbouring voxels along each axis or, if axes are not perpendicular, the matrix of steps."""
    if affine is not None:
        if sampling is not None:
            raise TruefieldError("give sampling or affine, not both")
        matrix = _matrix(affine, axes)
        lengths = np.linalg.norm(matrix, axis=0)
        cosines = (matrix / lengths).T @ (matrix / lengths) - np.eye(axes)
        return [float(length) for length in lengths] if np.abs(cosines).max() <= _PERPENDICULAR else matrix
    try:
        values = np.asarray(1.0 if sampling is None else sampling, dtype=np.float64)
    except (TypeError, ValueError):
        raise TruefieldError(f"sampling is {sampling!r}; give a length, or one for each axis") from None
    if values.ndim > 1 or (values.ndim == 1 and values.size != axes):
        raise TruefieldError(
            f"sampling has {values.size} lengths for {axes} axes; give one for each axis, or one for all"
        )
    if not np.all(np.isfinite(values) & (values > 0)):
        raise TruefieldError(f"sampling is {sampling}; give positive lengths")
    return [float(value) for value in np.broadcast_to(values, axes)]


def _matrix(affine: ArrayLike, axes: int) -> Floats:
    try:
        matrix = np.asarray(affine, dtype=np.float64)
    except (TypeError, ValueError):
        raise TruefieldError("the affine is no matrix of numbers") from None
    if matrix.shape == (axes + 1, axes + 1):
        if not np.array_equal(matrix[axes], [0.0] * axes + [1.0]):
            raise TruefieldError(f"the last row of the affine is {matrix[axes]}; give one that ends in zeros and a one")
        matrix = matrix[:axes, :axes]
    if matrix.shape != (axes, axes):
        raise TruefieldError(
            f"the affine has shape {matrix.shape}; an image of {axes} axes needs ({axes}, {axes}) or one more each"
        )
    lengths = np.linalg.norm(matrix, axis=0)
    if not np.all(np.isfinite(matrix)) or not np.all(lengths > 0) or np.linalg.matrix_rank(matrix / lengths) < axes:
        raise TruefieldError(
            "the affine is singular or not finite, so voxels have no size; give one that can be inverted"
        )
    return matrix


def periodic_axes(periodic: Periodic, axes: int) -> list[bool]:
    """Whether the image goes on with its other end, for each axis."""
    values = np.asarray(periodic)
    if values.dtype != bool or values.ndim > 1 or (values.ndim == 1 and values.size != axes):
        raise TruefieldError(f"periodic is {periodic!r}; give True or False, or one of them for each of {axes} axes")
    return [bool(value) for value in np.broadcast_to(values, axes)]


def index_type(voxels: int) -> np.dtype[Any]:
    """The type of flat indices."""
    return np.dtype(np.uint32 if voxels < 2**31 else np.uint64)


def afford(shape: tuple[int, ...], each: int, memory: int | None) -> int:
    """Bytes that are left when every voxel takes so many."""
    needed, allowed = each * int(np.prod([int(n) for n in shape], dtype=object)), arguments.memory(memory)
    if needed > allowed:
        raise MemoryError(
            f"a transform of {' x '.join(map(str, shape))} voxels would need about {needed / 2**20:.1f} MiB but only "
            f"{allowed / 2**20:.1f} MiB are allowed; transform parts of the image or allow more memory"
        )
    return allowed - needed
