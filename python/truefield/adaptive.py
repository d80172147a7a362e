"""Adaptively sampled fields: distances on a tree of cells that is fine where the shape asks for it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield import _truefield, arguments
from truefield.arguments import Floats, Progress
from truefield.csg import sweep
from truefield.errors import TruefieldError
from truefield.fields import Surface
from truefield.files import PathLike
from truefield.immutable import Immutable, Unpack
from truefield.mesh import TriangleMesh
from truefield.nearest import Nearest
from truefield.sampled import SampledField
from truefield.shape import Shape, Solid, unite
from truefield.shape import shape as as_shape

if TYPE_CHECKING:
    from PIL import Image


Method = Literal["linear", "cubic", "exact", "mixed"]
Rule = Literal["verified", "samples"]
Crossing = Literal["linear", "cubic"]

_DEEPEST = 24


@dataclass(frozen=True, slots=True)
class RayHits:
    """What rays meet first, a row for each ray.

    Attributes:
        distance: (n,) float64 from the origin, model units whatever the direction's length; infinite for a miss.
        point: (n, 3) float64 places; NaN for a miss.
        normal: (n, 3) float64 unit gradients of the field there, outward; NaN for a miss.
    """

    distance: Floats
    point: Floats
    normal: Floats

    @property
    def hit(self) -> NDArray[np.bool_]:
        """(n,) whether anything is met."""
        return np.isfinite(self.distance)


@dataclass(frozen=True, slots=True)
class Leaves:
    """The leaves of a tree, a row for each, children in the order x fastest.

    Attributes:
        low: (n, 3) float64 lowest corners.
        high: (n, 3) float64 highest corners.
        lower: (n,) float64; no distance in the leaf is less than what the leaf says by more than this (negative).
        upper: (n,) float64; nor greater by more than this. For exact leaves: than their interpolated corners.
    """

    low: Floats
    high: Floats
    lower: Floats
    upper: Floats


@dataclass(frozen=True, slots=True)
class _Made:
    """What an edited field is of: put together when it is asked for."""

    before: Shape | _Made
    operation: str
    tool: Shape
    radius: float

    def shape(self) -> Shape:
        edits: list[_Made] = []
        shape: Shape | _Made = self
        while isinstance(shape, _Made):
            edits.append(shape)
            shape = shape.before
        # Edits of one kind, one after the other, are one step.
        for operation, group in groupby(reversed(edits), key=lambda edit: edit.operation):
            several = list(group)
            tools = [edit.tool for edit in several]
            match operation:
                case "carve":
                    shape = shape - unite(tools)
                case "fill":
                    shape = unite([shape, *tools])
                case "intersect":
                    for tool in tools:
                        shape = shape & tool
                case _:
                    for edit in several:
                        shape = shape.blend(edit.tool, edit.radius, "polynomial")
        return shape


class AdaptiveField(Immutable):
    """Distances at the corners of the cells of an octree, with a proven error for each cell. Immutable.

    Made by `adaptive_field`.
    """

    __slots__ = ("_made", "_native")

    def __init__(self, native: _truefield.AdaptiveField, made: Shape | _Made | None = None) -> None:
        """For makers of fields: the compiled field, and what it is of, where that is known."""
        self._native = native
        self._made = made

    def __reduce__(self) -> tuple[Unpack, tuple[bytes]]:
        """Pickles what `save` would write; the copy does not know its `shape`."""
        from truefield import storage

        return storage.unpacked, (storage.packed(self),)

    @property
    def shape(self) -> Shape | None:
        """What the field is of, all edits included; None for one that was loaded, or made of samples."""
        if isinstance(self._made, _Made):
            self._made = self._made.shape()
        return self._made

    @property
    def extent(self) -> tuple[Floats, Floats]:
        """The lower and upper corner, each (3,), of the domain."""
        low, high = self._native.extent
        return np.array(low), np.array(high)

    def leaves(self) -> Leaves:
        """Places and proven errors of all leaves."""
        return Leaves(*self._native.leaves())

    def statistics(self) -> dict[str, int]:
        """Counts: cells, leaves, of these cubic and exact ones, entries of lists, depth, bytes."""
        return self._native.statistics()

    def distance(self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None) -> Floats:
        """(n,) float64 signed distances as the field has them, negative inside; NaN outside the domain."""
        return self._native.distance(arguments.points(points), threads, progress)

    def bounds(
        self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None
    ) -> tuple[Floats, Floats]:
        """Lower and upper bounds, (n,) float64 each, of the true signed distances; outside the domain too.

        There, of a field whose domain holds the whole solid, by a search for the nearest cell that may hold surface:
        about as near as the tolerance, many times as dear as a question inside.
        """
        return self._native.bounds(arguments.points(points), threads, progress)

    def gradient(self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None) -> Floats:
        """(n, 3) float64 unit vectors in which the field grows fastest, outward; NaN outside the domain."""
        return self._native.gradient(arguments.points(points), threads, progress)

    def nearest(self, points: ArrayLike, *, threads: int | None = None, progress: Progress | None = None) -> Nearest:
        """Where the surface is nearest, from `points`.

        `.distance` and `.normal` are those of `distance` and `gradient`. Of a field with `method="exact"` that was not
        edited, `.point`, `.triangle` and `.feature` are the mesh's, exactly. Of others `.point` is an estimate, found
        by walking down `distance`, and then along the surface for as long as that comes nearer, to where `distance` is
        within a thousandth of the tolerance, or within the tolerance itself where the field has no such place, so that
        `bounds` of it says how far from the surface it may be; `.triangle` is -1 and `.feature` 0. On balls, boxes, a
        torus and a casting-like part, tolerance a thousandth of the longest side, 99 of 100 were no more than a
        twentieth of that side farther than the nearest one; 2 to 5 microseconds a point. All NaN, and -1, outside the
        domain, and `.point` NaN where the field is too coarse to lead to its surface.
        """
        points = arguments.points(points)
        point, triangle, feature = _truefield.adaptive_nearest(self._native, points, threads, progress)
        return Nearest(
            self.distance(points, threads=threads, progress=progress),
            point,
            triangle,
            feature,
            self.gradient(points, threads=threads, progress=progress),
        )

    def raycast(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        *,
        method: Crossing = "linear",
        distance: float = 0.0,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> RayHits:
        """Where rays first meet the surface at signed `distance`: the first change of side along each ray.

        Args:
            origins: (n, 3), or (3,) for all rays.
            directions: (n, 3), or (3,) for all rays, of any length but zero.
            method: "linear" takes the value to be linear along the way through a cell, as Frisken et al. 2000 do;
                "cubic" finds the exact crossing of the trilinear interpolation. With both, exact leaves are met in
                their triangles at distance 0; else they are followed step by step, as tricubic ones are.
            distance: of the surface, model units, negative inside.
            threads: worker threads; hits never depend on them.
            progress: called as `progress(phase, fraction)`.

        A ray that starts inside meets the surface where it leaves. Beyond the domain all is outside. Between cells of
        different size, where the field has a crack, nothing leaks through: a ray enters a cell with the side with
        which it left the last. With "cubic", a hit is where the field is at `distance`, to rounding; the field's own
        error is what `bounds` say. The first call at a distance looks at every cell, some 30 milliseconds a million.

        Raises:
            TruefieldError: origins or directions are not (n, 3) finite numbers, a direction is zero, or the surface at
                `distance` would leave the domain, of a field whose domain holds the whole solid.
        """
        start, along = _rays(origins, directions)
        level = arguments.number("distance", distance)
        return RayHits(*_truefield.cast_rays(self._native, start, along, method, level, threads, progress))

    def occluded(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        length: float = np.inf,
        *,
        method: Crossing = "linear",
        distance: float = 0.0,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> NDArray[np.bool_]:
        """(n,) whether rays meet the surface within `length`, model units; see `raycast`."""
        start, along = _rays(origins, directions)
        far, level = arguments.number("length", length), arguments.number("distance", distance)
        return _truefield.occluded_rays(self._native, start, along, far, method, level, threads, progress)

    def surface(
        self,
        distance: float = 0.0,
        *,
        shape: Solid | None = None,
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> TriangleMesh:
        """The surface at signed `distance` as a closed triangle mesh: dual contouring, Ju et al. 2002.

        Args:
            distance: model units, negative inside.
            shape: the part or shape that the field is of: it is asked for exact crossings and normals, and sharp edges
                and corners are kept. `AdaptiveField.shape` by default; where that is None they are rounded within the
                field's error.
            memory: refuse to take more bytes than this; half the machine's memory by default.
            threads: worker threads; the mesh never depends on them.
            progress: called as `progress(phase, fraction)`.

        Guaranteed for any field: each side of a triangle belongs to just one other, which runs along it the other
        way, and the triangles around a vertex are one fan: closed, oriented outward, manifold; cells of different size
        leave no cracks; each vertex lies in its cell. A solid that the domain cuts is closed there. Not guaranteed:
        where cells are large beside the shape, triangles may cross each other or have no area (`TriangleMesh.check`
        tells), and parts thinner than a cell are not seen where no corner of a cell lies in them.

        Raises:
            TruefieldError: no corner of a cell is below `distance`; or the surface at `distance` would leave the
                domain, of a field whose domain holds the whole solid: build it with a larger `domain`.
            MemoryError: the mesh does not fit.
        """
        of = self.shape if shape is None else as_shape(shape)
        native = None if of is None else of._native
        vertices, triangles, low, high = _truefield.adaptive_surface(
            self._native,
            arguments.number("distance", distance),
            native,
            arguments.memory(memory),
            threads,
            progress,
        )
        return TriangleMesh.trusted(vertices, triangles, np.array(low), np.array(high), "surface")

    def carve(
        self,
        tool: Solid,
        path: ArrayLike | None = None,
        *,
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> AdaptiveField:
        """The field without the tool: max(field, -tool), a new field; this one stays as it is.

        Args:
            tool: a Shape, a mesh, a Surface or another AdaptiveField, whose errors then count too.
            path: what the tool is swept along, as `csg.sweep` takes it: (n, 3) points or (n, 4, 4) poses; the tool must
                then be a ball or convex.
            memory: refuse to take more bytes for new cells; half the machine's memory by default.
            threads: worker threads; the field never depends on them.
            progress: called as `progress(phase, fraction)`.

        Only cells that meet the tool's box, grown by half its longest side, are looked at; all others, and what
        memory they are in, are shared by both fields. New cells keep to the field's tolerance and growth beside the
        old values, and are divided by its rule: on a field made with rule="samples" a stroke is a matter of
        milliseconds, on a verified one it takes some ten times as many cells. `bounds` hold the distance of the
        carved solid everywhere, also far away, where its nearest point may be gone; what is only bounded by a point
        inside says so. To undo, keep the old field.

        Raises:
            TruefieldError: the path has no points, or the field or the tool cannot be used.
            MemoryError: the new cells would not fit.
        """
        return self._edited("carve", tool, 0.0, path=path, memory=memory, threads=threads, progress=progress)

    def fill(
        self,
        tool: Solid,
        path: ArrayLike | None = None,
        *,
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> AdaptiveField:
        """The field with the tool added: min(field, tool); see `carve`."""
        return self._edited("fill", tool, 0.0, path=path, memory=memory, threads=threads, progress=progress)

    def intersect(
        self,
        tool: Solid,
        *,
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> AdaptiveField:
        """What is in both: max(field, tool). All of the domain is looked at; see `carve`."""
        return self._edited("intersect", tool, 0.0, memory=memory, threads=threads, progress=progress)

    def blend(
        self,
        tool: Solid,
        radius: float,
        *,
        memory: int | None = None,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> AdaptiveField:
        """The field with the tool added and the seam filled by a parabola, where both differ by less than `radius`.

        min(field, tool) - h^2 / (4 radius), h = radius - |field - tool| where that is positive; see `carve`.
        """
        return self._edited(
            "blend", tool, arguments.length("radius", radius), memory=memory, threads=threads, progress=progress
        )

    def level_of_detail(
        self,
        tolerance: float | None = None,
        depth: int | None = None,
        *,
        threads: int | None = None,
        progress: Progress | None = None,
    ) -> AdaptiveField:
        """A coarser field, by cutting the tree; no source is asked.

        Args:
            tolerance: leaves are the first cells whose error is at most this at the surface, model units, and grows
                with the distance from it as the field's own may; or
            depth: leaves are no deeper than this; 0 is one cell.
            threads: worker threads.
            progress: called as `progress(phase, fraction)`.

        Every cell keeps its error, so that `bounds` still hold the true distance; coarser cells never promise more.

        Raises:
            TruefieldError: both are given, or none, or one that cannot be used.
        """
        error = None if tolerance is None else arguments.length("tolerance", tolerance)
        deepest = None if depth is None else min(_DEEPEST, arguments.count("depth", depth, least=0))
        return AdaptiveField(_truefield.level_of_detail(self._native, error, deepest, threads, progress))

    def save(self, path: PathLike, *, threads: int | None = None, progress: Progress | None = None) -> None:
        """Writes the field to one file, by custom named `.tfield`, level by level; `truefield.load` reads it.

        The first levels are a coarser field: `truefield.load(path, depth=k)` reads no more of the file than those. The
        loaded field answers the same, bit for bit. The file appears whole or not at all, with checksums for every
        level.

        Raises:
            FileError: the file cannot be written.
        """
        from truefield import storage

        storage.save(self, path, threads=threads, progress=progress)

    def _edited(
        self,
        operation: str,
        tool: Solid,
        radius: float,
        *,
        path: ArrayLike | None = None,
        memory: int | None,
        threads: int | None,
        progress: Progress | None,
    ) -> AdaptiveField:
        cutter = as_shape(tool) if path is None else sweep(tool, path)
        native = _truefield.edit_field(
            self._native, cutter._native, operation, radius, arguments.memory(memory), threads, progress
        )
        made = None if self._made is None else _Made(self._made, operation, cutter, radius)
        return AdaptiveField(native, made)

    def render(self, path: PathLike | None = None, **how: Any) -> Image.Image:
        """A picture of the field by rays; see `truefield.pictures.field_picture` for what it takes."""
        from truefield.pictures import field_picture

        return field_picture(self, path, **how)

    def __repr__(self) -> str:
        """Counts."""
        counts = self.statistics()
        return f"AdaptiveField({counts['leaves']} leaves, depth {counts['depth']}, {counts['bytes'] / 2**20:.1f} MiB)"


def adaptive_field(
    part: Solid | SampledField,
    tolerance: float | None = None,
    *,
    growth: float = 0.05,
    max_depth: int | None = None,
    domain: tuple[ArrayLike, ArrayLike] | None = None,
    method: Method = "linear",
    rule: Rule = "verified",
    memory: int | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> AdaptiveField:
    """The adaptively sampled field of a part or shape (Frisken, Perry, Rockwood and Jones 2000).

    Args:
        part: a mesh, a Surface, a Shape, or an AdaptiveField to sample anew; or a SampledField, whose cells are merged
            where one says the same as eight within the tolerance (bottom up; its errors are those of the samples,
            `max_depth` may not be less than they need, and `domain`, `method` and `rule` do not matter).
        tolerance: the largest error at the surface, model units. Exact leaves have none: they do without, and edits of
            them then keep to a thousandth of the part's longest side.
        growth: how much the error may grow per unit of distance from the surface; infinite divides only cells that
            meet it.
        max_depth: no cell is divided at this depth, whatever its error; 24 by default, 20 for meshes.
        domain: lowest and highest corner of the box to cover; the part's box with an eighth on all sides by default.
            The tree is a cube around it.
        method: "linear" interpolates eight corners, "cubic" 64 samples where eight are not enough; "exact", for meshes,
            keeps the triangles that can be nearest (the complete field of Huang et al. 2001 inside the tree), and its
            answers are exact; "mixed", for meshes, interpolates where that is within the tolerance and keeps triangles
            as soon as they are few: for fine tolerances, which take "linear" many small cells along edges.
        rule: "verified" divides until the error is proven; "samples" until the paper's 19 samples agree: quicker, with
            several times fewer leaves on scanned parts. `bounds` are proven with both.
        memory: refuse to take more bytes than this; half the machine's memory by default.
        threads: worker threads; the field never depends on them.
        progress: called as `progress(phase, fraction)`.

    Raises:
        TruefieldError: an argument cannot be used, or the shape has no end and no domain is given.
        MemoryError: the tree would not fit.
    """
    box = None if domain is None else arguments.box("domain", domain)
    deepest = _DEEPEST if max_depth is None else arguments.count("max_depth", max_depth, least=0)
    surface = Surface(part, threads=threads, progress=progress) if isinstance(part, TriangleMesh) else part
    if tolerance is None:
        if method != "exact" or not isinstance(surface, Surface):
            raise TruefieldError("adaptive_field needs a tolerance: the largest error at the surface, in model units")
        low, high = surface.mesh.extent
        tolerance = 1e-3 * float(np.max(high - low))
    error, slope = arguments.length("tolerance", tolerance), arguments.number("growth", growth)
    room = arguments.memory(memory)
    if isinstance(surface, SampledField):
        merged = _truefield.merged_samples(
            surface._native,
            error,
            slope,
            deepest,
            room,
            threads,
            progress,
        )
        return AdaptiveField(merged)
    shape = as_shape(surface)
    if isinstance(surface, Surface) and method != "cubic":
        native = _truefield.AdaptiveField.of_surface(
            surface._native, error, slope, deepest, box, method, rule, room, threads, progress
        )
    else:
        native = _truefield.AdaptiveField(
            shape._native, error, slope, deepest, box, method, rule, room, threads, progress
        )
    return AdaptiveField(native, shape)


def _rays(origins: ArrayLike, directions: ArrayLike) -> tuple[Floats, Floats]:
    start, along = arguments.points(origins), arguments.vectors(directions)
    if len(start) != len(along) and 1 not in (len(start), len(along)):
        raise TruefieldError(f"{len(start)} origins need as many directions, not {len(along)}; or give one for all")
    count = max(len(start), len(along)) if len(start) and len(along) else 0
    start, along = (np.ascontiguousarray(np.broadcast_to(rows, (count, 3))) for rows in (start[:count], along[:count]))
    return start, along
