"""Exact distance transforms of images and volumes.

An image is an array whose axes are the axes of space, in its own order: `sampling` and `affine` name them in
that order. Zero is background, everything else foreground.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, TypedDict, overload

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import ArrayLike, NDArray

from truefield import _truefield, voxels
from truefield.arguments import Floats, Progress
from truefield.errors import TruefieldError
from truefield.voxels import Periodic, Sampling

if TYPE_CHECKING:
    from typing_extensions import Unpack

if TYPE_CHECKING:
    from truefield.marching import Farther

Distances = NDArray[np.float32]
Placing = Literal["centers", "between"]
Target = Literal["background", "other_label"]
Border = Literal["nothing", "background", "foreground"]
Method = Literal["exact", "wavefront", "marching"]


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
        passes: passes of the wavefront that changed something, on either side of a signed one. None for other methods.
        changed: (passes,) voxels that each of them changed. None for other methods.
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

    def farther_than(
        self,
        exact: DistanceTransform,
        sampling: Sampling = None,
        *,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> Farther:
        """How many voxels have a site farther than in the exact transform of the same image, and by how much.

        Args:
            exact: the same transform with method="exact". Both need indices.
            sampling: as it was given to both.
            threads: worker threads.
            progress: called as `progress(phase, fraction)`.

        Raises:
            TruefieldError: there are no indices, the images differ, or `exact` holds sites that are not the nearest.
        """
        from truefield import marching

        return marching.farther(self, exact, sampling, threads, progress)


class _Options(TypedDict, total=False):
    """What does not decide the type of the result."""

    sampling: Sampling
    affine: ArrayLike | None
    signed: bool
    surface: Placing
    target: Target
    periodic: Periodic
    border: Border
    out: Distances | None
    memory: int | None
    threads: int | None
    progress: Progress | None


@overload
def distance_transform(
    image: ArrayLike,
    *,
    method: Literal["exact"] = ...,
    return_indices: Literal[False] = ...,
    return_bounds: Literal[False] = ...,
    **options: Unpack[_Options],
) -> Distances: ...
@overload
def distance_transform(
    image: ArrayLike,
    *,
    method: Literal["wavefront", "marching"],
    return_indices: bool = ...,
    return_bounds: bool = ...,
    **options: Unpack[_Options],
) -> DistanceTransform: ...
@overload
def distance_transform(
    image: ArrayLike,
    *,
    method: Method = ...,
    return_indices: Literal[True],
    return_bounds: bool = ...,
    **options: Unpack[_Options],
) -> DistanceTransform: ...
@overload
def distance_transform(
    image: ArrayLike,
    *,
    method: Method = ...,
    return_indices: bool = ...,
    return_bounds: Literal[True],
    **options: Unpack[_Options],
) -> DistanceTransform: ...
@overload
def distance_transform(
    image: ArrayLike,
    *,
    method: Method = ...,
    return_indices: bool = ...,
    return_bounds: bool = ...,
    **options: Unpack[_Options],
) -> Distances | DistanceTransform: ...
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
) -> Distances | DistanceTransform:
    """The exact Euclidean distance of every voxel to the nearest voxel of the background.

    Args:
        image: array of any number of axes; zero is background. Booleans, integers and float32 or float64 in C or
            Fortran order are read where they are; other orders and types are copied.
        sampling: distance of neighbouring voxels along each axis, or one for all (default 1).
        affine: in place of `sampling`, the (n, n) or (n + 1, n + 1) matrix that takes indices to positions. Two or
            three axes may be at any angles; with cosines above 1e-7, a tree over the boundary is searched.
        signed: also give background voxels their distance to the foreground, and make the foreground's negative.
        surface: "centers": distances go from centre to centre. "between": they go from the centre to the faces between
            foreground and background voxels, half a voxel nearer where a face is straight ahead.
        target: "background", or "other_label": the nearest voxel of any other value; zero is then a label like others.
        periodic: whether the image goes on with its other end, for all axes or for each.
        border: what lies beyond the image along axes that are not periodic: "nothing" to be near to, "background", or
            "foreground". With "other_label", "foreground" is a label of its own.
        method: "exact"; "wavefront": rings of voxels pass on where their nearest site is, as in *Bounded distance
            transforms of trimmed NURBS*; "marching": voxels do so in the order of their distance. See below.
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

    On two threads, 512^3 voxels take 4 to 7 nanoseconds of processor time each, twice that with indices or signs; at
    256^3, four times that with bounds, and where the sampling has no whole ratios; 200 to 3000 along skewed axes.

    Bounds hold whatever rule made voxels of the surface. Unsigned: for every surface that stays within the voxels of
    the background and meets each of them that has a neighbour in the foreground. Signed or with labels: for every
    surface that stays within voxels that have a neighbour (across faces, edges or corners) of another label,
    if the shape of each label has a point in each of its voxels. No closer bounds hold for all of these; they are never
    farther from the distance of centres than half a diagonal of a voxel, or three halves towards the surface if signed,
    and along axes that are not perpendicular just as far.

    A wavefront finds the same distances: its passes are in step, which makes it exact, and there are fewer of them than
    voxels along the longest axis. In the order of distance some voxels keep a site slightly farther than the nearest;
    `DistanceTransform.farther_than` counts them. Both take 1 to 3 axes, from centre to centre, none periodic, and
    nothing beyond the border. A wavefront takes 18 to 22 bytes a voxel and 12 to 16 for each that a pass changes; a
    march, on one thread, takes 16 and 16 for each trial. They give a `DistanceTransform`.

    Saito and Toriwaki 1994 and Felzenszwalb and Huttenlocher 2012 show that squared distances are separable.

    Raises:
        TruefieldError: an argument cannot be used, or the image holds NaN.
        MemoryError: the result would not fit the budget.
    """
    _choice("method", method, ("exact", "wavefront", "marching"))
    _choice("surface", surface, ("centers", "between"))
    _choice("target", target, ("background", "other_label"))
    _choice("border", border, ("nothing", "background", "foreground"))
    if signed and target == "other_label":
        raise TruefieldError(
            "labels have no inside, so signed distances need target='background'; leave one of them out"
        )
    given = voxels.array(image)
    if out is not None:
        _fits(out, given.shape)
    if method != "exact":
        from truefield import marching

        return marching.transform(
            given, sampling=sampling, affine=affine, signed=signed, surface=surface, target=target, periodic=periodic,
            border=border, method=method, return_indices=return_indices, return_bounds=return_bounds, out=out,
            memory=memory, threads=threads, progress=progress,
        )  # fmt: skip
    place = voxels.placement(sampling, affine, given.ndim)
    around = voxels.periodic_axes(periodic, given.ndim)
    index = voxels.index_type(given.size)
    spare = voxels.afford(given.shape, 4 * (out is None) + index.itemsize * return_indices + 8 * return_bounds, memory)
    goal = "other_side" if signed else target
    values, turned = voxels.readable(given, goal == "other_label", fortran=not return_indices and out is None)
    if turned:
        place, around = place[..., ::-1] if isinstance(place, np.ndarray) else place[::-1], around[::-1]
    if out is not None and np.may_share_memory(out, values):
        values = values.copy()
    job = _Job(values, place, around, goal, border, surface, spare, threads, progress)
    distance = np.empty(values.shape, np.float32) if out is None else out
    sites = np.empty(values.shape, index) if return_indices else None
    job.distance(distance, sites)
    if not return_indices and not return_bounds:
        return distance.T if turned else distance
    lower = upper = None
    if return_bounds:
        lower, upper = job.bounds(distance)
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
    given = voxels.array(labels)
    place = voxels.placement(sampling, affine, given.ndim)
    around = voxels.periodic_axes(periodic, given.ndim)
    index = voxels.index_type(given.size)
    spare = voxels.afford(given.shape, 4 + index.itemsize + given.itemsize, memory)
    values, _ = voxels.readable(given, labels=False, fortran=False)
    if not values.any():
        return np.array(given)
    sites = np.empty(values.shape, index)
    job = _Job(values, place, around, "foreground", "nothing", "centers", spare, threads, progress)
    job.distance(np.empty(values.shape, np.float32), sites)
    found: NDArray[Any] = np.ascontiguousarray(given).reshape(-1)[sites]
    return found


@dataclass(frozen=True)
class _Job:
    """A transform as the core takes it."""

    values: NDArray[Any]
    place: list[float] | Floats
    periodic: list[bool]
    target: str
    border: str
    surface: str
    memory: int
    threads: int | None
    progress: Progress | None

    def __post_init__(self) -> None:
        """Refuses what only perpendicular axes can have."""
        if isinstance(self.place, list):
            return
        if self.values.ndim not in (2, 3):
            raise TruefieldError(
                f"the affine has {self.values.ndim} axes that are not perpendicular; only 2 and 3 axes may be so"
            )
        if any(self.periodic) or self.border != "nothing":
            raise TruefieldError(
                "the axes of the affine are not perpendicular, and then the image can neither be periodic nor have a "
                "border; tile or pad it instead"
            )

    def distance(self, out: Distances, sites: NDArray[Any] | None, surface: str | None = None) -> None:
        """Writes distances and sites."""
        transform = _truefield.distance_transform if isinstance(self.place, list) else _truefield.skewed_transform
        flat = None if sites is None else sites.reshape(-1)
        asked = self._asked(surface or self.surface)
        transform(self.values.reshape(-1), asked, out.reshape(-1), flat, self.threads, self.progress)

    def bounds(self, distance: Distances) -> tuple[Distances, Distances]:
        """Bounds beside distances that were made before."""
        lower, upper = np.empty(self.values.shape, np.float32), np.empty(self.values.shape, np.float32)
        pair = lower.reshape(-1), upper.reshape(-1)
        if isinstance(self.place, list):
            _truefield.transform_bounds(
                self.values.reshape(-1), self._asked(self.surface), *pair, self.threads, self.progress
            )
            return lower, upper
        if self.surface != "centers":
            distance = np.empty(self.values.shape, np.float32)
            self.distance(distance, None, "centers")
        asked = self._asked("centers")
        _truefield.skewed_bounds(
            self.values.reshape(-1), asked, distance.reshape(-1), *pair, self.threads, self.progress
        )
        return lower, upper

    def _asked(self, surface: str) -> Any:
        shape = list(self.values.shape)
        if isinstance(self.place, list):
            return shape, self.place, self.periodic, self.target, self.border, surface, self.memory
        steps = np.zeros((len(shape), 3))
        steps[:, : len(shape)] = self.place.T
        return shape, steps.tolist(), self.target, surface, self.memory


def _choice(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        words = " or ".join(repr(word) for word in known)
        raise TruefieldError(f"{name} is {value!r}; choose {words}")


def _fits(out: Distances, shape: tuple[int, ...]) -> None:
    if not isinstance(out, np.ndarray) or out.dtype != np.float32 or out.shape != shape:
        given = f"{out.dtype} of shape {out.shape}" if isinstance(out, np.ndarray) else type(out).__name__
        raise TruefieldError(f"out is {given}; give a float32 array of shape {shape}")
    if not out.flags.c_contiguous or not out.flags.writeable:
        raise TruefieldError("out is not C-contiguous or may not be written; give an array made with numpy.empty")
