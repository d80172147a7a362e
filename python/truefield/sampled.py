"""Samples of a distance on a lattice: what a scanner or a simulation calls a volume, with its bounds.

Node-centred: sample [i, j, k] lies at `origin + spacing * (i, j, k)`, with a spacing for each axis.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield import _truefield, arguments
from truefield.arguments import Floats, Progress
from truefield.cloud import PointCloud
from truefield.errors import TruefieldError
from truefield.files import PathLike
from truefield.immutable import Immutable, Unpack
from truefield.mesh import TriangleMesh
from truefield.nearest import Nearest
from truefield.volume import Volume

Border = Literal["closed", "open"]
Placement = Literal["lattice", "projected"]
Side = Literal["inside", "outside"]


class SampledField(Immutable):
    """Signed distances at lattice points in single precision, with what is known of the truth behind them.

    `Surface.sample` makes one of a part, `from_array` one of any array. It is asked like every field: between samples
    `distance` is interpolated trilinearly, and `bounds` encloses the truth there too, because a distance changes by no
    more than one moves. Fields on one lattice are combined as solids: `a | b`, `a & b`, `a - b`, `~a`, `a.offset(d)`.
    """

    __slots__ = ("_native",)

    def __init__(self, native: _truefield.SampledField) -> None:
        """Wraps the compiled field; `Surface.sample` and `from_array` make one."""
        self._native = native

    def __reduce__(self) -> tuple[Unpack, tuple[bytes]]:
        """Pickles what `save` would write."""
        from truefield import storage

        return storage.unpacked, (storage.packed(self),)

    @classmethod
    def from_array(
        cls,
        values: ArrayLike,
        origin: ArrayLike = (0.0, 0.0, 0.0),
        spacing: ArrayLike = 1.0,
        *,
        error: float | None = None,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
    ) -> SampledField:
        """A field of samples from elsewhere; the arrays are copied.

        Args:
            values: (x, y, z) signed distances, negative inside, stored as float32.
            origin: (3,) position of sample [0, 0, 0], model units.
            spacing: distance of neighbouring samples along each axis, (3,) or one number for all, model units.
            error: the true distance is within this of each value, model units; rounding to float32 included.
            lower: (x, y, z) lower bounds of the true distances, or
            upper: (x, y, z) upper bounds; both are stored as float32, rounded outward.

        With neither error nor bounds nothing is promised: `bounds` answers minus to plus infinity.

        Raises:
            TruefieldError: the arrays do not fit together, hold what is not a number, or bounds that miss their value.
        """
        samples = np.ascontiguousarray(_volume("values", values), dtype=np.float32)
        if error is not None and (lower is not None or upper is not None):
            raise TruefieldError("give error, or lower and upper, not both")
        if (lower is None) != (upper is None):
            raise TruefieldError("lower and upper belong together; give both or neither")
        low, step = _three("origin", origin), _three("spacing", spacing)
        if lower is not None and upper is not None:
            below, above = _outward("lower", lower, -np.inf), _outward("upper", upper, np.inf)
            return cls(_truefield.SampledField(samples, low, step, lower=below, upper=above))
        known = np.inf if error is None else arguments.number("error", error)
        return cls(_truefield.SampledField(samples, low, step, known))

    @classmethod
    def from_volume(
        cls,
        volume: Volume,
        *,
        error: float | None = None,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
    ) -> SampledField:
        """The field whose samples a volume holds; see `from_array`.

        Raises:
            TruefieldError: it is an image, or its axes are turned: then place its `values` yourself.
        """
        if volume.values.ndim != 3 or not volume.straight:
            what = "is an image" if volume.values.ndim != 3 else "has axes that are turned"
            raise TruefieldError(f"'{volume.name}' {what}; a field has samples along x, y and z: use from_array")
        place = {"origin": volume.origin, "spacing": volume.spacing}
        return cls.from_array(volume.values, **place, error=error, lower=lower, upper=upper)

    def volume(self, name: str = "distance") -> Volume:
        """The samples with their place, for a file: `field.volume().write("distance.nrrd")`; not a copy."""
        return Volume(self.values, self.origin, self.spacing, name=name)

    @property
    def values(self) -> NDArray[np.float32]:
        """(x, y, z) float32 signed distances; read-only, not a copy."""
        return self._native.values

    @property
    def lower(self) -> NDArray[np.float32]:
        """(x, y, z) float32, never above the true distance; a fresh array."""
        return self._native.lower

    @property
    def upper(self) -> NDArray[np.float32]:
        """(x, y, z) float32, never below the true distance; a fresh array."""
        return self._native.upper

    @property
    def origin(self) -> Floats:
        """(3,) position of sample [0, 0, 0], model units."""
        return np.array(self._native.lattice[0])

    @property
    def spacing(self) -> Floats:
        """(3,) distance of neighbouring samples along each axis, model units."""
        return np.array(self._native.lattice[1])

    @property
    def shape(self) -> tuple[int, int, int]:
        """Number of samples along x, y and z."""
        x, y, z = self._native.lattice[2]
        return x, y, z

    def distance(self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None) -> Floats:
        """(n,) float64 trilinear interpolation of the samples, NaN outside the lattice; `bounds` says how good.

        It may miss the bounds by a little, where eight samples know more together than their weighted mean does.
        """
        return self._native.distance(arguments.points(points), threads, progress)

    def bounds(
        self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None
    ) -> tuple[Floats, Floats]:
        """(n,) float64 lower and upper bounds of the true distances, at any point.

        The true distance differs between two points by at most the way between them, so each of the eight samples
        around a point bounds it; outside the lattice, the samples nearest to the point do.
        """
        return self._native.bounds(arguments.points(points), threads, progress)

    def gradient(self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None) -> Floats:
        """(n, 3) float64 unit vectors along the gradient of `distance`, outward; NaN outside the lattice.

        The derivative of the trilinear interpolation, which jumps from cell to cell; zero where the samples around are
        all the same.
        """
        return self._native.gradient(arguments.points(points), threads, progress)

    def nearest(self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None) -> Nearest:
        """Where the surface is, from `points`, as far as samples tell: an estimate, found by walking down `distance`.

        `.distance` and `.normal` are those of `distance` and `gradient`; `.point` lies where `distance` is zero up to a
        thousandth of the spacing, so `bounds` of it says how far from the surface it may be; NaN outside the lattice,
        and where walking finds no surface: beyond a band, or where it lies outside the lattice. Samples know of no
        triangles: `.triangle` is -1 and `.feature` 0.
        """
        points = arguments.points(points)
        return Nearest(
            self.distance(points, threads=threads, progress=progress),
            self._native.foot(points, threads, progress),
            np.full(len(points), -1, np.int64),
            np.zeros(len(points), np.uint8),
            self.gradient(points, threads=threads, progress=progress),
        )

    def surface(
        self,
        distance: float = 0.0,
        *,
        border: Border = "closed",
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> TriangleMesh:
        """The surface at signed `distance` as a closed triangle mesh: marching cubes, Lorensen and Cline 1987.

        Args:
            distance: model units, negative inside.
            border: "closed" closes a surface that reaches the border of the lattice, half a spacing beyond the last
                samples; "open" ends it there, with a rim.
            memory: refuse to take more bytes than this; half the machine's memory by default.
            threads: worker threads; the mesh never depends on them.
            progress: called as `progress(phase, fraction)`.

        Each vertex lies between two neighbouring samples, one below `distance` and one not, where the straight line
        between them is at `distance`. Whatever the samples, each side of a triangle belongs to just one other, which
        runs along it the other way ("open": but for the rim): closed, oriented outward, no holes. Vertices coincide
        only where a sample is at `distance` itself. Where the sides of samples are certain the true surface is within a
        spacing of each vertex; what is thinner than a spacing may be missing.

        Raises:
            TruefieldError: no two neighbouring samples are on different sides of `distance`.
            MemoryError: the mesh does not fit.
        """
        level = arguments.number("distance", distance)
        vertices, triangles, low, high = self._native.surface(
            level, border, arguments.memory(memory), threads, progress
        )
        return TriangleMesh.trusted(vertices, triangles, np.array(low), np.array(high), "surface")

    def contour(
        self,
        distance: float,
        tolerance: float,
        *,
        placement: Placement = "lattice",
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> PointCloud:
        """Samples the places where the interpolation is at signed `distance`.

        Args:
            distance: model units, negative inside.
            tolerance: E: the interpolation at each point is within E/2 of `distance`, and each place where it is
                `distance` is within E/2 of a point.
            placement: "lattice" keeps the centres of parts of cells; "projected" moves each point onto the contour
                unless that is in another cell; each place of the contour is then within E of a point.
            memory: refuse to take more bytes than this; half the machine's memory by default.
            threads: worker threads; neither points nor their order depend on it.
            progress: called as `progress(phase, fraction)`.

        The scalars `lower` and `upper` of each point hold the true distance there. 64 bytes a point.

        Raises:
            TruefieldError: the distance or tolerance cannot be used.
            MemoryError: the contour has more points than fit.
        """
        points, normals, lower, upper = self._native.contour(
            arguments.number("distance", distance),
            arguments.length("tolerance", tolerance),
            placement,
            arguments.memory(memory),
            threads,
            progress,
        )
        return PointCloud(points, normals, scalars={"lower": lower, "upper": upper})

    def medial_axis(
        self,
        side: Side = "inside",
        *,
        angle: float = 60.0,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> PointCloud:
        """The places between samples where the nearest point of the surface jumps.

        Args:
            side: "inside": the centres of the largest balls that fit into the solid; "outside": around it.
            angle: degrees: how far apart the two nearest points must at least be seen from there. Wide angles keep the
                middles of walls, small ones also the creases that run into corners.
            threads: worker threads; the result never depends on it.
            progress: called as `progress(phase, fraction)`.

        Points lie on the middles of edges of the lattice; their scalars are `radius`, the distance to the surface, and
        `angle`. They are within about three spacings of the medial axis, one and a half where the surface is flat: a
        measure, not a bound. Within two spacings of the surface nothing is found, nor beyond a band.

        Raises:
            TruefieldError: the side or angle cannot be used.
        """
        points, radii, angles = self._native.medial_axis(side, arguments.number("angle", angle), threads, progress)
        return PointCloud(points, scalars={"radius": radii, "angle": angles})

    def save(self, path: PathLike, *, progress: Progress | None = None) -> None:
        """Writes the field with all that is known of it to one file, a `.tfield`; `truefield.load` reads it.

        The loaded field answers the same, bit for bit. `volume().write` is for other programs, which know no bounds.

        Raises:
            FileError: the file cannot be written.
        """
        from truefield import storage

        storage.save(self, path, progress=progress)

    def offset(
        self,
        distance: float,
        *,
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> SampledField:
        """The solid grown by `distance`, model units, or shrunk if it is negative.

        Values are the samples less `distance`. Bounds enclose the distance of the new solid: as narrow as they were
        outside of one that grows and inside of one that shrinks. On its other side, where fronts that met may have
        left it deeper than the samples say, one bound comes from the samples across, some percent wider. Takes 29 bytes
        a sample while it runs, 12 then.

        Raises:
            TruefieldError: the field is of a mesh with openings or of no distances, or `distance` is not finite.
            MemoryError: the samples do not fit into `memory` bytes, half the machine's memory by default.
        """
        length = arguments.number("distance", distance)
        return SampledField(self._native.offset(length, arguments.memory(memory), threads, progress))

    def union(
        self,
        other: SampledField,
        *,
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> SampledField:
        """What is in one solid or in the other; also written `a | b`.

        Values are the lesser of both. That is the distance of the union outside of it, and inside where the other solid
        is farther than the boundary of the one; elsewhere the union is deeper, and `bounds` tells how deep at most.

        Raises:
            TruefieldError: the fields are on different lattices (see `resample`), or of a mesh with openings.
            MemoryError: the samples do not fit into `memory` bytes, half the machine's memory by default.
        """
        return self._combined("union", other, memory, threads, progress)

    def intersection(
        self,
        other: SampledField,
        *,
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> SampledField:
        """What is in both solids; also written `a & b`. Values are the greater of both; see `union` for bounds."""
        return self._combined("intersection", other, memory, threads, progress)

    def difference(
        self,
        other: SampledField,
        *,
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> SampledField:
        """What is in this solid and not in the other; also written `a - b`. See `union` for bounds."""
        return self._combined("difference", other, memory, threads, progress)

    def complement(self) -> SampledField:
        """What is outside: all signs changed, as exact as before; also written `~a`."""
        return SampledField(self._native.complement())

    def resample(
        self,
        like: SampledField | None = None,
        *,
        origin: ArrayLike | None = None,
        spacing: ArrayLike | None = None,
        shape: tuple[int, int, int] | None = None,
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> SampledField:
        """The field on another lattice: interpolated values, and bounds that enclose the truth at the new samples.

        Args:
            like: a field whose lattice to take, or
            origin: (3,) position of the first sample, model units; the field's own by default,
            spacing: along each axis, (3,) or one number for all, model units; the field's own by default,
            shape: number of samples along x, y and z; by default as many as fit into the field.
            memory: refuse to take more bytes than this; half the machine's memory by default.
            threads: worker threads.
            progress: called as `progress(phase, fraction)`.

        Beyond the field's lattice, values go on growing from its border. Takes 12 bytes a sample.

        Raises:
            TruefieldError: the lattice cannot be used.
            MemoryError: the samples do not fit.
        """
        if like is not None:
            if not (origin is None and spacing is None and shape is None):
                raise TruefieldError("give a field to be like, or origin, spacing and shape, not both")
            origin, spacing, shape = like.origin, like.spacing, like.shape
        low = self.origin.tolist() if origin is None else _three("origin", origin)
        step = self.spacing.tolist() if spacing is None else _three("spacing", spacing)
        if shape is None:
            high = self.origin + (np.asarray(self.shape) - 1) * self.spacing
            with np.errstate(divide="ignore", invalid="ignore"):
                counts = np.floor((high - low) / np.asarray(step) + 1e-9) + 1
            counted = arguments.shape(counts, min(step))
        else:
            x, y, z = (arguments.count("shape", n, least=1) for n in shape)
            counted = (x, y, z)
        native = self._native.resample(low, step, counted, arguments.memory(memory), threads, progress)
        return SampledField(native)

    def _combined(
        self, name: str, other: SampledField, memory: int | None, threads: int | None, progress: Progress | None
    ) -> SampledField:
        if not isinstance(other, SampledField):
            raise TruefieldError(f"a SampledField is combined with another, not with {type(other).__name__}")
        return SampledField(self._native.combine(name, other._native, arguments.memory(memory), threads, progress))

    def __or__(self, other: SampledField) -> SampledField:
        """The union."""
        return self.union(other) if isinstance(other, SampledField) else NotImplemented

    def __and__(self, other: SampledField) -> SampledField:
        """The intersection."""
        return self.intersection(other) if isinstance(other, SampledField) else NotImplemented

    def __sub__(self, other: SampledField) -> SampledField:
        """The difference."""
        return self.difference(other) if isinstance(other, SampledField) else NotImplemented

    def __invert__(self) -> SampledField:
        """The complement."""
        return self.complement()

    def __repr__(self) -> str:
        """Shape and spacing."""
        (x, y, z), (a, b, c) = self.shape, self.spacing.tolist()
        return f"SampledField({x} x {y} x {z} samples, spacing {a:.6g}, {b:.6g}, {c:.6g})"


def _volume(name: str, values: ArrayLike) -> NDArray[np.float64] | NDArray[np.float32]:
    try:
        array = np.asarray(values)
        if array.dtype != np.float32:
            array = np.asarray(array, dtype=np.float64)
    except (TypeError, ValueError):
        raise TruefieldError(f"{name} are not numbers; give an array of shape (x, y, z)") from None
    if array.ndim != 3 or array.size == 0:
        raise TruefieldError(f"{name} has shape {array.shape}; give an array of shape (x, y, z)")
    return array


def _outward(name: str, bounds: ArrayLike, towards: float) -> NDArray[np.float32]:
    """As float32, rounded towards minus or plus infinity."""
    given = _volume(name, bounds)
    with np.errstate(over="ignore"):
        single = np.ascontiguousarray(given, dtype=np.float32)
    inward = single > given if towards < 0 else single < given
    if inward.any():
        single = np.where(inward, np.nextafter(single, np.float32(towards)), single)
    return single


def _three(name: str, value: ArrayLike) -> list[float]:
    try:
        three = np.broadcast_to(np.asarray(value, dtype=np.float64), 3)
    except (TypeError, ValueError):
        said = " ".join(repr(value).split())
        raise TruefieldError(f"{name} is {said:.80}; give three numbers, one for each axis") from None
    return [float(v) for v in three]
