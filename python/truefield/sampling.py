"""Lattices over parts: the signed distance at their points, and the voxels around them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield import _truefield, arguments
from truefield.arguments import Floats, Progress
from truefield.errors import TruefieldError
from truefield.fields import CompleteField, Sign, Surface
from truefield.mesh import TriangleMesh
from truefield.sampled import SampledField
from truefield.volume import Volume

Source = TriangleMesh | Surface | CompleteField
SamplingMethod = Literal["exact", "wavefront"]
VoxelRule = Literal["conservative", "separating_6", "separating_26", "solid"]


@dataclass(frozen=True, eq=False)
class Voxels:
    """Marked voxels of a part, and the surface nearest to those that lie on it.

    Attributes:
        volume: (x, y, z) booleans with their place: voxel [i, j, k] is the cube, one spacing wide, around
            `origin + spacing * (i, j, k)`.
        index: (m, 3) int64 index of each marked voxel, in order; empty for solid voxels.
        triangle: (m,) int64 triangle nearest to its centre; the lowest where several tie.
        distance: (m,) float64 distance from its centre to that triangle, model units, not signed; exact.
        doubtful: how many centres no sign rule could tell to be inside or outside; solid voxels take the better guess.
    """

    volume: Volume
    index: NDArray[np.int64]
    triangle: NDArray[np.int64]
    distance: Floats
    doubtful: int

    @property
    def values(self) -> NDArray[np.bool_]:
        """(x, y, z) bool, True for marked voxels; read-only."""
        return self.volume.values

    @property
    def origin(self) -> Floats:
        """(3,) centre of voxel [0, 0, 0], model units."""
        return self.volume.origin

    @property
    def spacing(self) -> Floats:
        """(3,) edges of a voxel, model units."""
        return self.volume.spacing

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of voxels along x, y and z."""
        return self.volume.shape

    def __array__(self, dtype: np.dtype[np.bool_] | None = None, copy: bool | None = None) -> NDArray[np.bool_]:
        """The marks."""
        return np.array(self.values, dtype) if copy else np.asarray(self.values, dtype)


def sampled_field(
    part: Source,
    resolution: int | None = None,
    spacing: float | None = None,
    *,
    band: float | None = None,
    method: SamplingMethod = "exact",
    margin: float = 0.0,
    extent: tuple[ArrayLike, ArrayLike] | None = None,
    sign: Sign = "auto",
    memory: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> SampledField:
    """Samples the signed distance of a part on a lattice.

    Args:
        part: a mesh, a surface that is ready already, or a complete field.
        resolution: samples along the longest side of the box (default 256), or
        spacing: distance of neighbouring samples, model units.
        band: keep |distance| <= band only; farther samples hold plus or minus the band.
        method: "exact", or "wavefront": of the voxels around the samples, those that the surface touches are found, and
            a wavefront carries their nearest triangles on, as *Bounded distance transforms of trimmed NURBS* does for
            triangle soups.
        margin: the box is grown by this on all sides, model units.
        extent: the lowest and the highest corner of the box; that of the part by default.
        sign: the sign rule of the surface; see `Surface`. Surfaces and complete fields have one.
        memory: refuse to take more bytes than this; half the machine's memory by default.
        threads: worker threads; samples never depend on it.
        progress: called as `progress(phase, fraction)`.

    Exact samples are the distance rounded to single precision; they take 4 bytes each. A wavefront's samples are upper
    bounds of the distance, exact where the surface touches the voxel; their intervals are at most root 3 spacings
    wide, as `lower` and `upper` say; they take 36 bytes each while it runs, 12 then.

    Raises:
        TruefieldError: an argument cannot be used, or a wavefront has no voxel to start from.
        MemoryError: the samples do not fit.
    """
    if method not in ("exact", "wavefront"):
        raise TruefieldError(f"method is {method!r}; choose 'exact' or 'wavefront'")
    surface = _surface(part, sign, threads, progress)
    low, high = surface.mesh.extent if extent is None else _box(extent)
    origin, step, shape = arguments.lattice(low, high, resolution, spacing, margin)
    sample = _truefield.sample if method == "exact" else _truefield.sample_marched
    allowed = arguments.memory(memory)
    return SampledField(sample(surface._native, origin, step, shape, band, allowed, threads, progress))


def voxelize(
    part: Source,
    resolution: int | None = None,
    spacing: float | None = None,
    *,
    rule: VoxelRule = "conservative",
    margin: float = 0.0,
    extent: tuple[ArrayLike, ArrayLike] | None = None,
    sign: Sign = "auto",
    memory: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Voxels:
    """Marks the voxels of a part: cubes around the points of the lattice that `sampled_field` takes.

    Args:
        part: a mesh, a surface that is ready already, or a complete field.
        resolution: voxels along the longest side of the box (default 256); those at its ends are half outside, or
        spacing: edge of a voxel, model units.
        rule: "conservative": every voxel that the surface touches, its faces included. "separating_6": about half as
            many, but no path of empty voxels over common faces leads through the surface. "separating_26": no path over
            faces, edges or corners does; a plane needs all the voxels it touches for that, edges and corners of a part
            need fewer. "solid": every voxel whose centre is inside.
        margin: the box is grown by this on all sides, model units.
        extent: the lowest and the highest corner of the box; that of the part by default.
        sign: the sign rule of the surface, for solid voxels; see `Surface`.
        memory: refuse to take more bytes than this; half the machine's memory by default.
        threads: worker threads; voxels never depend on it.
        progress: called as `progress(phase, fraction)`.

    Contact within rounding counts as touching, so no touched voxel is missed. Thin voxels are those of Laine, *A
    topological approach to voxelization* (2013): the surface meets a segment from the centre of the voxel to
    that of a neighbour.

    Takes a byte a voxel, and 40 for each marked voxel of the surface; 64 while it runs.

    Raises:
        TruefieldError: an argument cannot be used.
        MemoryError: the voxels do not fit.
    """
    surface = _surface(part, sign, threads, progress)
    low, high = surface.mesh.extent if extent is None else _box(extent)
    origin, step, shape = arguments.lattice(low, high, resolution, spacing, margin)
    marks, index, triangle, distance, doubtful = _truefield.voxelize(
        surface._native, origin, step, shape, rule, arguments.memory(memory), threads, progress
    )
    volume = Volume(marks, origin, step, name=surface.mesh.name)
    return Voxels(volume, index, triangle, distance, doubtful)


def _surface(part: Source, sign: Sign, threads: int | None, progress: Progress | None) -> Surface:
    if isinstance(part, TriangleMesh):
        return Surface(part, sign, threads=threads, progress=progress)
    if isinstance(part, CompleteField):
        return part.surface
    if isinstance(part, Surface):
        return part
    hint = "; use its resample" if isinstance(part, SampledField) else ""
    raise TruefieldError(
        f"the part is a {type(part).__name__}; give a TriangleMesh, a Surface or a CompleteField{hint}"
    )


def _box(extent: tuple[ArrayLike, ArrayLike]) -> tuple[Floats, Floats]:
    low, high = (np.array(corner) for corner in arguments.box("extent", extent))
    if not (np.all(np.isfinite(low)) and np.all(np.isfinite(high)) and np.all(low <= high)):
        raise TruefieldError(f"extent is {extent!r}; give the lowest and the highest corner of a box")
    return low, high
