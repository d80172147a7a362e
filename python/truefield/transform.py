"""Exact distance transforms of images and volumes.

An image is an array whose axes are the axes of space, in its own order: `sampling` and `affine` name them in
that order. Zero is background, everything else foreground.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import ArrayLike, NDArray

from truefield import _truefield, arguments
from truefield.arguments import Floats, Progress
from truefield.errors import TruefieldError

Distances = NDArray[np.float32]
Sampling = float | Sequence[float] | Floats | None
Periodic = bool | Sequence[bool]
Placing = Literal["centers", "between"]
Target = Literal["background", "other_label"]
Border = Literal["nothing", "background", "foreground"]
Method = Literal["exact"]

# Axes whose cosine is below this are perpendicular: no distance differs by more than single precision resolves.
_PERPENDICULAR = 1e-7


@dataclass(frozen=True, eq=False)
class DistanceTransform(NDArrayOperatorsMixin):
    """Distances with what was asked for beside them; as an array, it is its `distance`.

    Attributes:
        distance: float32 distances, of the image's shape.
        sites: the flat (C order) index of each voxel's nearest site, uint32 or uint64, of the image's shape; the lowest
            of equals along axes that are not periodic. The largest number of its type where there is none or
            the border is nearest. None unless indices were asked for.
        lower: float32, never above the true distance. None unless bounds were asked for.
        upper: float32, never below the true distance. None unless bounds were asked for.
        passes: passes over the image until nothing changed. None for the exact method.
        changed: voxels that changed in each pass. None for the exact method.
    """

    distance: Distances
    sites: NDArray[np.uint32] | NDArray[np.uint64] | None = None
    lower: Distances | None = None
    upper: Distances | None = None
    passes: int | None = None
    changed: NDArray[np.int64] | None = None

    @cached_property
    def indices(self) -> NDArray[np.int32] | NDArray[np.int64] | None:
        """(axes, *shape) index of each voxel's nearest site along each axis, as SciPy gives them; -1 for no site.

        Made from `sites` when first asked for; takes 4 bytes (8 from 2^31 voxels on) a voxel and axis.
        """
        if self.sites is None:
            return None
        kind = np.int32 if self.sites.dtype == np.uint32 else np.int64
        made = np.empty((self.sites.ndim, *self.sites.shape), kind)
        _truefield.site_indices(self.sites.reshape(-1), list(self.sites.shape), made.reshape(-1))
        return made

    @property
    def shape(self) -> tuple[int, ...]:
        """The image's shape."""
        return self.distance.shape

    @property
    def dtype(self) -> np.dtype[np.float32]:
        """Float32."""
        return self.distance.dtype

    def __len__(self) -> int:
        """Number of voxels along the first axis."""
        return len(self.distance)

    def __getitem__(self, key: Any) -> Any:
        """Distances of some voxels."""
        return self.distance[key]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        """The distances."""
        if copy is False and dtype is not None and np.dtype(dtype) != self.distance.dtype:
            raise ValueError("distances are float32; another type needs a copy")
        return np.array(self.distance, dtype=dtype) if copy else np.asarray(self.distance, dtype=dtype)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
        """Calculates with the distances."""
        plain = [x.distance if isinstance(x, DistanceTransform) else x for x in inputs]
        return getattr(ufunc, method)(*plain, **options)


def distance_transform(
    image: ArrayLike,
    *,
    sampling: Sampling = None,
    affine: ArrayLike | None = None,
    signed: bool = False,
    surface: Placing = "centers",
    target: Target = "background",
    periodic: Periodic = False,
    border: Border = "nothing",
    method: Method = "exact",
    return_indices: bool = False,
    return_bounds: bool = False,
    out: Distances | None = None,
    memory: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Any:
    """The exact Euclidean distance of every voxel to the nearest voxel of the background.

    Args:
        image: array of any number of axes; zero is background. Booleans, integers and float32 or float64 in C or
            Fortran order are read where they are; other orders and types are copied.
        sampling: distance of neighbouring voxels along each axis, or one for all (default 1).
        affine: in place of `sampling`, the (n, n) or (n + 1, n + 1) matrix that takes indices to positions.
        signed: also give background voxels their distance to the foreground, and make the foreground's negative.
        surface: "centers": distances go from centre to centre. "between": they go from the centre to the faces between
            foreground and background voxels, half a voxel nearer where a face is straight ahead.
        target: "background", or "other_label": the nearest voxel of any other value; zero is then a label like others.
        periodic: whether the image goes on with its other end, for all axes or for each.
        border: what lies beyond the image along axes that are not periodic: "nothing" to be near to, "background", or
            "foreground". With "other_label", "foreground" is a label of its own.
        method: "exact".
        return_indices: also find which voxel is nearest.
        return_bounds: also enclose the distance to the surface that the voxels stand for: see below.
        out: C-contiguous float32 array of the image's shape to write into; `distance` is then this array.
        memory: refuse to take more bytes than this; half the machine's memory by default.
        threads: worker threads, all cores by default; results never depend on it.
        progress: called as `progress(phase, fraction)`.

    Returns:
        A float32 array of the image's shape and order, or a `DistanceTransform` with `return_indices` or
        `return_bounds`. Without any background voxel there is nothing to be near to: all distances are infinite (and of
        the foreground's sign).

    Squared distances are whole numbers until the root is taken, if the sampling is one, or in whole ratios, and they
    fit 31 bits; elsewhere they are double precision. The result is rounded to single precision once. This takes the
    result and some MiB for each thread; 4 bytes a voxel more for indices (8 from 2^31 voxels on), 8 for bounds, and 8
    while it runs where the sampling has no whole ratios (1 : pi) or squares do not fit.

    Bounds hold whatever rule made voxels of the surface. Unsigned: for every surface that stays within the voxels of
    the background and meets each of them that has a neighbour in the foreground. Signed or with labels: for every
    surface that stays within voxels that have a neighbour (across faces, edges or corners) of another label,
    if the shape of each label has a point in each of its voxels. No closer bounds hold for all of these; they are never
    farther from the distance than the paper's half diagonal of a voxel, or 3/2 of it to the surface's side if signed.

    Saito and Toriwaki 1994 and Felzenszwalb and Huttenlocher 2012 show that squared distances are separable.

    Raises:
        TruefieldError: an argument cannot be used, or the image holds NaN.
        MemoryError: the result would not fit the budget.
    """
    _choice("method", method, ("exact",))
    _choice("surface", surface, ("centers", "between"))
    _choice("target", target, ("background", "other_label"))
    _choice("border", border, ("nothing", "background", "foreground"))
    if signed and target == "other_label":
        raise TruefieldError(
            "labels have no inside, so signed distances need target='background'; leave one of them out"
        )
    array = _image(image)
    spacing = _spacing(sampling, affine, array.ndim)
    around = _periodic(periodic, array.ndim)
    extra = return_indices or return_bounds
    spare = _afford(
        array.shape, (4 * (out is None) + _site(array.size).itemsize * return_indices + 8 * return_bounds), memory
    )
    goal = "other_side" if signed else target
    voxels, turned = _readable(array, goal == "other_label", fortran=not return_indices and out is None)
    if turned:
        spacing, around = spacing[::-1], around[::-1]
    if out is not None:
        _fits(out, array.shape)
        if np.may_share_memory(out, voxels):
            voxels = voxels.copy()
    asked = (list(voxels.shape), spacing, around, goal, border, surface, spare)
    flat = voxels.reshape(-1)
    distance = np.empty(voxels.shape, np.float32) if out is None else out
    sites = np.empty(voxels.shape, _site(array.size)) if return_indices else None
    _truefield.distance_transform(
        flat, asked, distance.reshape(-1), None if sites is None else sites.reshape(-1), threads, progress
    )
    if not extra:
        return distance.T if turned else distance
    lower = upper = None
    if return_bounds:
        lower, upper = np.empty(voxels.shape, np.float32), np.empty(voxels.shape, np.float32)
        _truefield.transform_bounds(flat, asked, lower.reshape(-1), upper.reshape(-1), threads, progress)
        if turned:
            lower, upper = lower.T, upper.T
    return DistanceTransform(distance.T if turned else distance, sites, lower, upper)


def voronoi(
    labels: ArrayLike,
    *,
    sampling: Sampling = None,
    affine: ArrayLike | None = None,
    periodic: Periodic = False,
    memory: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> NDArray[Any]:
    """Gives every voxel the label of the nearest voxel that is not zero.

    Args:
        labels: array of whole numbers; zeros are to be filled.
        sampling: distance of neighbouring voxels along each axis, or one for all (default 1).
        affine: in place of `sampling`, the matrix that takes indices to positions.
        periodic: whether the image goes on with its other end, for all axes or for each.
        memory: refuse to take more bytes than this; half the machine's memory by default.
        threads: worker threads; results never depend on it.
        progress: called as `progress(phase, fraction)`.

    Returns:
        An array like `labels`. Of voxels as near, the one of lowest index gives its label. All zeros stay all zeros.

    Takes 8 bytes a voxel beside the result.
    """
    array = _image(labels)
    spacing = _spacing(sampling, affine, array.ndim)
    around = _periodic(periodic, array.ndim)
    spare = _afford(array.shape, 4 + _site(array.size).itemsize + array.itemsize, memory)
    voxels, _ = _readable(array, labels=False, fortran=False)
    if not voxels.any():
        return np.array(array)
    sites = np.empty(voxels.size, _site(array.size))
    asked = (list(voxels.shape), spacing, around, "foreground", "nothing", "centers", spare)
    distance = np.empty(voxels.size, np.float32)
    _truefield.distance_transform(voxels.reshape(-1), asked, distance, sites, threads, progress)
    found: NDArray[Any] = np.ascontiguousarray(array).reshape(-1)[sites].reshape(array.shape)
    return found


def _image(image: ArrayLike) -> NDArray[Any]:
    array = np.asarray(image)
    if array.dtype.kind not in "biuf":
        raise TruefieldError(f"the image holds {array.dtype}; give booleans, whole numbers or real numbers")
    if array.ndim == 0:
        raise TruefieldError("the image is a single number; give an array of at least one axis")
    return array


def _readable(array: NDArray[Any], labels: bool, fortran: bool) -> tuple[NDArray[Any], bool]:
    """The image as the core reads it, a copy only where it must be, and whether its axes are reversed."""
    if array.dtype.byteorder == ">" or (array.dtype.kind == "f" and array.itemsize not in (4, 8)):
        array = array.astype(np.float64 if array.dtype.kind == "f" else array.dtype.newbyteorder("="))
    turned = fortran and array.flags.f_contiguous and not array.flags.c_contiguous
    array = array.T if turned else np.ascontiguousarray(array)
    if labels and (array.itemsize == 8 or array.dtype.kind == "f"):
        if array.dtype.kind == "f" and np.isnan(array).any():
            raise TruefieldError("the image holds values that are not a number; they are no labels")
        # Zero stays zero, as it is what borders may be.
        values, numbers = np.unique(array, return_inverse=True)
        zero = np.searchsorted(values, 0)
        numbers = numbers.reshape(array.shape)
        if zero < values.size and values[zero] == 0:
            array = np.where(numbers == zero, 0, np.where(numbers < zero, numbers + 1, numbers)).astype(np.uint32)
        else:
            array = (numbers + 1).astype(np.uint32)
    if array.dtype.kind in "bi":
        array = array.view(f"u{array.itemsize}")
    return array, turned


def _spacing(sampling: Sampling, affine: ArrayLike | None, axes: int) -> list[float]:
    if affine is not None:
        if sampling is not None:
            raise TruefieldError("give sampling or affine, not both")
        return _lengths(_matrix(affine, axes))
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


def _lengths(matrix: Floats) -> list[float]:
    """The lengths of the columns, if they are perpendicular."""
    lengths = np.linalg.norm(matrix, axis=0)
    cosines = (matrix / lengths).T @ (matrix / lengths) - np.eye(len(matrix))
    if np.abs(cosines).max() > _PERPENDICULAR:
        raise TruefieldError(
            "the axes of the affine are not perpendicular, so distances are not separable; resample the image first"
        )
    return [float(length) for length in lengths]


def _periodic(periodic: Periodic, axes: int) -> list[bool]:
    values = np.asarray(periodic)
    if values.dtype != bool or values.ndim > 1 or (values.ndim == 1 and values.size != axes):
        raise TruefieldError(f"periodic is {periodic!r}; give True or False, or one of them for each of {axes} axes")
    return [bool(value) for value in np.broadcast_to(values, axes)]


def _choice(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        words = " or ".join(repr(word) for word in known)
        raise TruefieldError(f"{name} is {value!r}; choose {words}")


def _site(voxels: int) -> np.dtype[Any]:
    """The type of flat indices."""
    return np.dtype(np.uint32 if voxels < 2**31 else np.uint64)


def _afford(shape: tuple[int, ...], each: int, memory: int | None) -> int:
    """Bytes that are left when every voxel takes so many."""
    needed, allowed = each * int(np.prod([int(n) for n in shape], dtype=object)), arguments.memory(memory)
    if needed > allowed:
        raise MemoryError(
            f"a transform of {' x '.join(map(str, shape))} voxels would need about {needed / 2**20:.1f} MiB but only "
            f"{allowed / 2**20:.1f} MiB are allowed; transform parts of the image or allow more memory"
        )
    return allowed - needed


def _fits(out: Distances, shape: tuple[int, ...]) -> None:
    if not isinstance(out, np.ndarray) or out.dtype != np.float32 or out.shape != shape:
        given = f"{out.dtype} of shape {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        raise TruefieldError(f"out is {given}; give a float32 array of shape {shape}")
    if not out.flags.c_contiguous or not out.flags.writeable:
        raise TruefieldError("out is not C-contiguous or may not be written; give an array made with numpy.empty")
