"""Distance transforms by marching: from voxel to voxel, each passing on where its nearest site is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield import _truefield, arguments, voxels
from truefield.arguments import Progress
from truefield.errors import TruefieldError
from truefield.transform import Distances, DistanceTransform
from truefield.voxels import Periodic, Sampling


@dataclass(frozen=True, slots=True)
class Farther:
    """By how much marched sites are farther than the nearest ones.

    Attributes:
        voxels: how many voxels have a site that is farther than their nearest.
        largest: the most by which one is farther, a length in units of the sampling.
    """

    voxels: int
    largest: float


def transform(
    image: ArrayLike,
    *,
    sampling: Sampling,
    affine: ArrayLike | None,
    signed: bool,
    surface: str,
    target: str,
    periodic: Periodic,
    border: str,
    method: str,
    return_indices: bool,
    return_bounds: bool,
    out: Distances | None,
    memory: int | None,
    threads: int | None,
    progress: Progress | None,
) -> DistanceTransform:
    """`truefield.distance_transform` for the methods "wavefront" and "marching"; see there."""
    given = voxels.array(image)
    spacing = voxels.placement(sampling, affine, given.ndim)
    for wanted, words in (
        (isinstance(spacing, np.ndarray), "an affine whose axes are not perpendicular"),
        (any(voxels.periodic_axes(periodic, given.ndim)), "periodic axes"),
        (surface != "centers", f"surface={surface!r}"),
        (target != "background", f"target={target!r}"),
        (border != "nothing", f"border={border!r}"),
    ):
        if wanted:
            raise TruefieldError(f"method={method!r} cannot do {words}; choose method='exact'")
    if given.dtype.kind == "f" and np.isnan(given).any():
        raise TruefieldError("the image holds values that are not a number; give them a value")
    background = np.ascontiguousarray(given == 0)
    march = _March(method, list(given.shape), list(spacing), arguments.memory(memory), threads, progress)
    sites, distance, changed = march.away_from(background)
    if signed:
        others, outside, more = march.away_from(~background)
        distance = np.where(background, outside, -distance)
        sites = np.where(background, others, sites)
        changed = _sum(changed, more)
    if out is not None:
        np.copyto(out, distance)
        distance = out
    lower = upper = None
    if return_bounds:
        from truefield.transform import distance_transform

        exact = distance_transform(
            given, sampling=sampling, affine=affine, signed=signed, return_bounds=True,
            memory=memory, threads=threads, progress=progress,
        )  # fmt: skip
        lower, upper = exact.lower, exact.upper
    passes = None if changed is None else len(changed)
    return DistanceTransform(distance, sites if return_indices else None, lower, upper, passes, changed)


def farther(
    marched: DistanceTransform,
    exact: DistanceTransform,
    sampling: Sampling,
    threads: int | None,
    progress: Progress | None,
) -> Farther:
    """`DistanceTransform.farther_than`; see there."""
    for name, found in (("marched", marched), ("exact", exact)):
        if found.sites is None:
            raise TruefieldError(f"the {name} transform has no indices to compare; make it with return_indices=True")
        if found.sites.shape != marched.shape:
            raise TruefieldError(
                f"the transforms have shapes {marched.shape} and {exact.shape}; compare those of one image"
            )
    spacing = voxels.placement(sampling, None, len(marched.shape))
    ours, theirs = (np.asarray(found.sites, np.uint32).reshape(-1) for found in (marched, exact))
    count, largest = _truefield.site_difference(ours, theirs, list(marched.shape), list(spacing), threads, progress)
    return Farther(count, largest)


@dataclass(frozen=True)
class _March:
    method: str
    shape: list[int]
    spacing: list[float]
    memory: int
    threads: int | None
    progress: Progress | None

    def away_from(
        self, marks: NDArray[np.bool_]
    ) -> tuple[NDArray[np.uint32], NDArray[np.float32], NDArray[np.int64] | None]:
        """Sites and distances of all voxels, and how many each pass changed."""
        flat = marks.reshape(-1)
        if self.method == "marching":
            sites, distance = _truefield.march(flat, self.shape, self.spacing, self.memory, self.progress)
            return sites.reshape(self.shape), distance.reshape(self.shape), None
        sites, distance, changed = _truefield.wavefront(
            flat, self.shape, self.spacing, self.memory, self.threads, self.progress
        )
        return sites.reshape(self.shape), distance.reshape(self.shape), changed.astype(np.int64)


def _sum(a: NDArray[np.int64] | None, b: NDArray[np.int64] | None) -> NDArray[np.int64] | None:
    """What both marches changed in each pass."""
    if a is None or b is None:
        return None
    both = np.zeros(max(len(a), len(b)), np.int64)
    both[: len(a)] += a
    both[: len(b)] += b
    return both
