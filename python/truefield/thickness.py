"""Depth, heavy sections and wall thickness of a solid part.

*Depth* is the distance of an inside point to the surface. *Wall thickness* is the diameter of the inscribed ball that
touches the wall there: twice the depth of its centre. The limits `above` and `below` are limits on wall thickness and
strict, so a heavy section is a connected region deeper than `above / 2`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from truefield import _truefield
from truefield._truefield import __version__
from truefield.arguments import Progress
from truefield.around import largest_around
from truefield.cloud import PointCloud
from truefield.errors import TruefieldError
from truefield.facets import refined
from truefield.fields import Part, SignRule, Surface
from truefield.files import PathLike, check_folder, replacing_folder
from truefield.formats import ply, table
from truefield.mesh import TriangleMesh

Point = tuple[float, float, float]
_Floats = NDArray[np.float64]

SCHEMA: Final = "truefield.thickness/1"
KINDS: Final = ("wall", "edge", "inner")
FILES: Final = (
    "report.json",
    "samples.csv",
    "heavy-sections.csv",
    "thickness.ply",
    "histogram.png",
    "thickness.png",
    "heavy-sections.png",
)
_PERCENTILES: Final = (1, 5, 95, 99)
_MOST_BALLS: Final = 100
_MOST_FACETS: Final = 250_000


@dataclass(frozen=True, slots=True)
class Bounds:
    """Contains the true value for certain; model units."""

    lower: float
    upper: float


@dataclass(frozen=True, slots=True)
class GreatestDepth:
    """The deepest place of a part."""

    point: Point
    """At least `depth.lower` deep."""
    depth: Bounds
    """Contains the greatest depth; no wider than the tolerance."""


@dataclass(frozen=True, slots=True)
class HeavySection:
    """A connected region where the part is deeper than half the limit `above`."""

    point: Point
    """The deepest place; at least `depth.lower` deep."""
    depth: Bounds
    """Contains the section's greatest depth; no wider than the tolerance."""
    volume: Bounds
    """Contains the section's volume, cubic model units."""
    box: tuple[Point, Point]
    """Lowest and highest corner of a box around the section, little larger than needed."""
    centroid: Point
    """Centre of gravity, an estimate."""
    certain: bool
    """Whether a place deeper than the limit was found; if not, the section may not exist."""


@dataclass(frozen=True, slots=True)
class HeavySections:
    """All heavy sections. Every place deeper than `depth` is in one of them, and no two are connected."""

    depth: float
    """The limit, half the wall thickness `above`; strict."""
    sections: tuple[HeavySection, ...]
    """Deepest first."""
    joined: float
    """All places of one section are connected at this depth at least: about `depth - tolerance`."""
    resolution: float
    """Diagonal of the largest cell that decided on a boundary."""


@dataclass(frozen=True, slots=True)
class Extreme:
    """The thinnest or thickest wall that was sampled, with both of its sides."""

    thickness: float
    point: Point
    """The place on the wall."""
    triangle: int
    opposite: Point
    """The place on the other wall."""
    opposite_triangle: int


@dataclass(frozen=True, slots=True)
class Statistics:
    """Wall thickness by one method; samples count by the area they stand for."""

    samples: int
    area: float
    minimum: Extreme
    maximum: Extreme
    mean: float
    median: float
    percentiles: dict[int, float]
    """1, 5, 95 and 99: at least that much per cent of the area is no thicker."""
    share_above: float | None
    """Share of the area, 0 to 1, where thickness > above; None without that limit."""
    share_below: float | None
    """Share of the area, 0 to 1, where thickness < below; None without that limit."""


@dataclass(frozen=True, slots=True)
class Count:
    """Samples that were set apart."""

    samples: int
    area: float


@dataclass(frozen=True, slots=True)
class WallSamples:
    """Places on the surface, one row each, in the order of the triangles: at least one on each that has an area.

    Attributes:
        point: (n, 3) float64, model units.
        normal: (n, 3) float64 unit normal out of the material, smoothed across the facets of a curved wall.
        triangle: (n,) int64.
        area: (n,) float64 surface area that the sample stands for.
        kind: (n,) uint8. 0 wall: the ball touches walls that oppose each other. 1 edge: it sits in a convex edge, held
            by two walls that meet just beyond it, and tells how near that edge is; also balls no larger than the
            tolerance, as in folds and needles of the mesh. 2 inner: not between inside and outside, as a face inside
            the material.
        thickness_sphere: (n,) float64 diameter of the inscribed ball that touches there; NaN on inner faces.
        thickness_ray: (n,) float64 way along the inward normal to the next wall; NaN on inner faces and without a hit.
        slack: (n,) float64; the ball may stay this far from the wall, which is what the facets of a curved wall stray
            from it; 0 on flat walls.
    """

    point: _Floats
    normal: _Floats
    triangle: NDArray[np.int64]
    area: _Floats
    kind: NDArray[np.uint8]
    thickness_sphere: _Floats
    thickness_ray: _Floats
    slack: _Floats

    def __len__(self) -> int:
        """The number of samples."""
        return len(self.area)


@dataclass(frozen=True, slots=True)
class Walls:
    """Wall thickness over the surface."""

    spacing: float
    """Mean distance between samples."""
    area: float
    sphere: Statistics | None
    """By inscribed balls, over the samples of kind wall; None if there are none."""
    ray: Statistics | None
    """By rays, over all samples whose ray hits; None if there are none."""
    edge: Count
    """Samples near sharp convex edges; not in `sphere`."""
    inner: Count
    """Samples on inner faces; in neither."""
    missed: int
    """Rays that left the part without a hit; 0 on a closed mesh."""
    slack: float
    """The largest slack of a sample; a ball's diameter is off by about twice the sample's own at most."""


@dataclass(frozen=True, slots=True)
class ThicknessReport:
    """All there is to say about the thickness of a part; lengths in model units."""

    part: str
    triangles: int
    tolerance: float
    above: float | None
    below: float | None
    sign_rule: SignRule
    greatest_depth: GreatestDepth
    heavy: HeavySections | None
    """None without a limit `above`."""
    walls: Walls
    samples: WallSamples = field(repr=False)
    _surface: Surface = field(repr=False, compare=False)

    @property
    def heavy_sections(self) -> tuple[HeavySection, ...]:
        """The heavy sections, deepest first; none without a limit `above`."""
        return () if self.heavy is None else self.heavy.sections

    @property
    def greatest_thickness(self) -> Bounds:
        """Contains the part's greatest wall thickness, twice its greatest depth."""
        depth = self.greatest_depth.depth
        return Bounds(2.0 * depth.lower, 2.0 * depth.upper)

    def sentences(self) -> list[str]:
        """The report in words."""
        greatest = self.greatest_thickness
        says = [
            f"The greatest wall thickness is between {greatest.lower:.6g} and {greatest.upper:.6g}, "
            f"at {_place(self.greatest_depth.point)}."
        ]
        if greatest.upper - greatest.lower > 2.0 * self.tolerance:
            says.append(
                "It is not known to the tolerance: sides are in doubt there, or the tolerance is beyond the search."
            )
        if self.heavy is not None and self.above is not None:
            count = len(self.heavy.sections)
            if greatest.upper <= self.above:
                says.append(f"No section is heavy: no wall is thicker than {self.above:.6g}.")
            elif count == 0:
                says.append(f"No heavy section was found: the thickest wall is at the limit of {self.above:.6g}.")
            else:
                plural = "1 section is" if count == 1 else f"{count} sections are"
                says.append(f"{plural} heavy: thicker than {self.above:.6g}.")
            doubtful = sum(not section.certain for section in self.heavy.sections)
            if doubtful:
                says.append(f"{doubtful} of them may not exist: they are at the limit to within the tolerance.")
        sphere = self.walls.sphere
        if sphere is None:
            says.append("No two walls oppose each other: all inscribed balls are held by sharp edges.")
        else:
            says.append(
                f"The walls are {sphere.minimum.thickness:.6g} to {sphere.maximum.thickness:.6g} thick, "
                f"half of their area up to {sphere.median:.6g}."
            )
        if self.walls.missed:
            says.append(f"{self.walls.missed} rays left the part without a hit: the mesh has holes.")
        if self.walls.inner.samples:
            says.append(f"{self.walls.inner.samples} samples lie on faces inside the material and were left out.")
        says.append(f"Inside and outside were decided by {self.sign_rule.name}: {self.sign_rule.reason}.")
        return says

    def to_json(self) -> str:
        """The report without its samples as JSON.

        `schema` names the version of this layout; within one version keys are only added. Lengths, areas and volumes
        are in model units, their square and their cube; `lower` and `upper` enclose the true value for certain;
        shares are 0 to 1; a value that does not exist is null.
        """
        return json.dumps(self._document(), indent=2, allow_nan=False) + "\n"

    def write(self, folder: PathLike, *, pictures: bool = True, threads: int | None = None) -> list[Path]:
        """Writes the report into a folder; all files appear together, or none. Returns their paths.

        `report.json` as `to_json`; `samples.csv`, one row a sample; `heavy-sections.csv`, one row a section;
        `thickness.ply`, the part with large facets split and the ball's diameter at each vertex as
        the scalar `thickness`; and the pictures `histogram.png`, `thickness.png` and `heavy-sections.png`, seen from
        the side of the thickest place. In `thickness.png` places beside sharp edges take the diameter of the largest
        ball close to them, and say so.

        Args:
            folder: made if it does not exist; its parent must.
            pictures: False leaves the pictures out.
            threads: worker threads.

        Raises:
            FileError: the folder cannot be written.
        """
        check_folder(folder)
        with replacing_folder(folder) as aside:
            (aside / "report.json").write_text(self.to_json(), encoding="utf-8")
            table.write(aside / "samples.csv", self._sample_columns())
            table.write(aside / "heavy-sections.csv", self._section_columns())
            mesh, values = self._facets(threads)
            self._write_mesh(aside / "thickness.ply", mesh, values)
            if pictures:
                self._draw(aside, threads)
            names = [name for name in FILES if (aside / name).exists()]
        return [Path(folder) / name for name in names]

    def cloud(self) -> PointCloud:
        """The samples as points with normals and the scalars `thickness`, `thickness_ray`, `area` and `kind`."""
        found = self.samples
        scalars: dict[str, NDArray[np.generic]] = {
            "thickness": found.thickness_sphere,
            "thickness_ray": found.thickness_ray,
            "area": found.area,
            "kind": found.kind,
        }
        return PointCloud(found.point, found.normal, found.triangle, scalars)

    def chart(self) -> PointCloud:
        """The samples as the pictures show them: points with normals and the scalar `thickness`.

        On walls that is the diameter of the ball that touches there. Beside sharp edges, where the ball is held by the
        edge and no measure of a wall, it is that of the largest ball close by: so a solid boss shows how heavy it is.
        NaN on inner faces.
        """
        found = self.samples
        thickness = np.where(found.kind == 2, np.nan, found.thickness_sphere)
        beside = np.flatnonzero(found.kind == 1)
        depth = self.greatest_depth
        radii = np.append(np.nan_to_num(0.5 * found.thickness_sphere), depth.depth.lower)
        centers = np.concatenate([found.point - radii[:-1, None] * found.normal, [depth.point]])
        around = largest_around(found.point[beside], found.normal[beside], centers, radii)
        thickness[beside] = np.maximum(thickness[beside], around)
        # Without the triangles: the normals of slivers would hide their samples.
        return PointCloud(found.point, found.normal, scalars={"thickness": thickness})

    def _document(self) -> dict[str, Any]:
        mesh = self._surface.mesh
        heavy = None
        if self.heavy is not None:
            heavy = {
                "limit": self.above,
                "strict": True,
                "depth": self.heavy.depth,
                "count": len(self.heavy.sections),
                "joined_depth": self.heavy.joined,
                "resolution": self.heavy.resolution,
                "sections": [_section(section) for section in self.heavy.sections],
            }
        walls = self.walls
        return {
            "schema": SCHEMA,
            "truefield": __version__,
            "units": {"length": "model units", "area": "square model units", "volume": "cubic model units"},
            "part": {
                "name": self.part,
                "triangles": self.triangles,
                "extent": {"min": mesh.extent[0].tolist(), "max": mesh.extent[1].tolist()},
            },
            "tolerance": self.tolerance,
            "limits": {"above": self.above, "below": self.below, "strict": True, "of": "wall thickness"},
            "sign_rule": asdict(self.sign_rule),
            "greatest_depth": asdict(self.greatest_depth),
            "greatest_thickness": asdict(self.greatest_thickness),
            "heavy_sections": heavy,
            "wall_thickness": {
                "spacing": walls.spacing,
                "area": walls.area,
                "samples": len(self.samples),
                "sphere": _statistics(walls.sphere),
                "ray": _statistics(walls.ray),
                "near_sharp_edges": asdict(walls.edge)
                | {"treatment": "held by two walls of a convex edge, or smaller than the tolerance: not in sphere"},
                "inner_faces": asdict(walls.inner),
                "rays_without_hit": walls.missed,
                "slack": walls.slack,
            },
            "summary": self.sentences(),
        }

    def _sample_columns(self) -> dict[str, NDArray[np.generic]]:
        found = self.samples
        columns: dict[str, NDArray[np.generic]] = dict(zip("xyz", found.point.T, strict=True))
        columns |= dict(zip(("nx", "ny", "nz"), found.normal.T, strict=True))
        return columns | {
            "triangle": found.triangle,
            "area": found.area,
            "thickness_sphere": found.thickness_sphere,
            "thickness_ray": found.thickness_ray,
            "kind": found.kind,
            "slack": found.slack,
        }

    def _section_columns(self) -> dict[str, NDArray[np.generic]]:
        rows = [
            (
                *s.point,
                *(s.depth.lower, s.depth.upper, 2.0 * s.depth.lower, 2.0 * s.depth.upper),
                *(s.volume.lower, s.volume.upper),
                *s.centroid,
                *s.box[0],
                *s.box[1],
            )
            for s in self.heavy_sections
        ]
        names = "x y z depth_lower depth_upper thickness_lower thickness_upper volume_lower volume_upper"
        names += " centroid_x centroid_y centroid_z min_x min_y min_z max_x max_y max_z"
        columns = np.array(rows, dtype=np.float64).reshape(len(rows), len(names.split())).T
        found: dict[str, NDArray[np.generic]] = {"section": np.arange(1, len(rows) + 1)}
        found |= dict(zip(names.split(), columns, strict=True))
        return found | {"certain": np.array([s.certain for s in self.heavy_sections], dtype=np.uint8)}

    def _facets(self, threads: int | None) -> tuple[TriangleMesh, _Floats]:
        """The part with small facets, and the ball's diameter on each; NaN near sharp edges and on inner faces."""
        mesh, parents = refined(self._surface.mesh, 3.0 * self.walls.spacing, most=_MOST_FACETS)
        # Facets that were not split have samples of their own.
        found = self.samples
        walls = found.kind == 0
        triangle, area = found.triangle[walls], found.area[walls]
        areas = np.bincount(triangle, area, self.triangles)
        sums = np.bincount(triangle, area * found.thickness_sphere[walls], self.triangles)
        values = np.where(areas > 0.0, sums / np.where(areas > 0.0, areas, 1.0), np.nan)[parents]
        split = np.flatnonzero(np.bincount(parents, minlength=self.triangles)[parents] > 1)
        if len(split):
            centers = np.ascontiguousarray(mesh.vertices[mesh.triangles[split]].mean(axis=1))
            largest = self.greatest_depth.depth.upper
            balls, kinds = _truefield.walls_at(
                self._surface._native, centers, parents[split], self.tolerance, largest, threads
            )
            values[split] = np.where(kinds == 0, balls, np.nan)
        return mesh, values

    def _write_mesh(self, path: Path, mesh: TriangleMesh, values: _Floats) -> None:
        """Each vertex gets the mean of the facets around it, by area; near sharp edges that of the nearest walls."""
        corners = mesh.vertices[mesh.triangles]
        areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        scalars = np.full(len(mesh.vertices), np.nan)
        known = values
        while True:
            counts = np.isfinite(known)
            weights = np.where(counts, areas, 0.0)
            sums, totals = np.zeros(len(scalars)), np.zeros(len(scalars))
            for corner in mesh.triangles.T:
                np.add.at(sums, corner, weights * np.where(counts, known, 0.0))
                np.add.at(totals, corner, weights)
            fresh = np.isnan(scalars) & (totals > 0.0)
            if not fresh.any():
                break
            scalars[fresh] = sums[fresh] / totals[fresh]
            # Facets without a value take that of their vertices, ring by ring.
            around = scalars[mesh.triangles]
            counted = np.isfinite(around)
            mean = np.where(counted, around, 0.0).sum(axis=1) / np.maximum(counted.sum(axis=1), 1)
            known = np.where(np.isfinite(known), known, np.where(counted.any(axis=1), mean, np.nan))
        with path.open("wb") as stream:
            ply.encode(mesh, stream, {"thickness": np.nan_to_num(scalars)})

    def _draw(self, folder: Path, threads: int | None) -> None:
        from truefield import pictures

        found, part = self.samples, self._surface.mesh
        walls = found.kind == 0
        spheres = walls if walls.any() else np.isfinite(found.thickness_sphere)
        data, weights = found.thickness_sphere[spheres], found.area[spheres]
        above, below, depth = self.above, self.below, self.greatest_depth
        view, chart = self._view(), self.chart()
        # One scale for both, so that a colour means the same.
        span = (float(data.min()), max(float(data.max()), 2.0 * depth.depth.lower))
        pictures.histogram_picture(
            data,
            weights,
            folder / "histogram.png",
            above=above,
            below=below,
            span=span,
            title=f"Wall thickness of {self.part}",
        )
        pictures.thickness_picture(
            part,
            chart.scalars["thickness"],
            folder / "thickness.png",
            at=chart,
            ball=(np.array(depth.point), depth.depth.lower),
            span=span,
            note="Beside sharp edges, where no ball touches two opposing walls: the largest ball close by.",
            above=above,
            below=below,
            view=view,
            threads=threads,
        )
        balls = [(np.array(s.point), s.depth.lower) for s in self.heavy_sections[:_MOST_BALLS]]
        pictures.heavy_sections_picture(
            part, balls, folder / "heavy-sections.png", above=above, view=view, threads=threads
        )

    def _view(self) -> Point:
        """The direction to look along, from above one of four corners: towards the side with the thickest place."""
        low, high = self._surface.mesh.extent
        x, y, _ = (np.array(self.greatest_depth.point) - 0.5 * (low + high)).tolist()
        near = 1e-3 * float(np.linalg.norm(high - low))
        return (1.0 if x < -near else -1.0, -1.0 if y > near else 1.0, -1.0)


def thickness(
    part: Part,
    tolerance: float | None = None,
    above: float | None = None,
    below: float | None = None,
    *,
    spacing: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> ThicknessReport:
    """Greatest depth, heavy sections and wall thickness of a part.

    The greatest depth and the heavy sections are certified: branch and bound over cells with bounds of second order in
    the cell size, from exact distances. Wall thickness is sampled: by the inscribed ball that touches the surface at
    the sample (Ma, Bae and Choi 2012) and by the ray along the inward normal.

    Args:
        part: a TriangleMesh, or a Surface for a sign rule of your choice.
        tolerance: width of all depth intervals, and how finely sections are told apart; a thousandth of the
            box's diagonal by default.
        above: walls thicker than this are heavy (strict); None leaves the heavy sections out.
        below: walls thinner than this are counted (strict).
        spacing: mean distance of samples on the surface; by default it gives about 20,000 samples.
        threads: worker threads, all cores by default; the report does not depend on it.
        progress: called as `progress(phase, fraction)`.

    A part of 135,000 triangles takes some seconds.

    Raises:
        TruefieldError: the part has no inside, or a length is not positive or below rounding.
    """
    if isinstance(part, TriangleMesh):
        surface = Surface(part, threads=threads, progress=progress)
    elif isinstance(part, Surface):
        surface = part
    else:
        raise TruefieldError(f"thickness asks a TriangleMesh or a Surface, not a {type(part).__name__}; read it first")
    if tolerance is None:
        low, high = surface.mesh.extent
        tolerance = 1e-3 * float(np.linalg.norm(high - low))
    asked = _Asked(
        _length("tolerance", tolerance),
        None if above is None else _length("above", above),
        None if below is None else _length("below", below),
    )
    spacing = None if spacing is None else _length("spacing", spacing)
    found = _truefield.thickness(surface._native, asked.tolerance, asked.above, asked.below, spacing, threads, progress)
    return _report(surface, asked, found)


class _Asked(NamedTuple):
    tolerance: float
    above: float | None
    below: float | None


def _report(surface: Surface, asked: _Asked, found: Mapping[str, Any]) -> ThicknessReport:
    """The report from what the compiled half found."""
    point, lower, upper = found["greatest_depth"]
    heavy, walls = found["heavy"], found["walls"]
    return ThicknessReport(
        part=surface.mesh.name,
        triangles=len(surface.mesh.triangles),
        tolerance=asked.tolerance,
        above=asked.above,
        below=asked.below,
        sign_rule=surface.sign_rule,
        greatest_depth=GreatestDepth(point, Bounds(lower, upper)),
        heavy=None if heavy is None else _heavy(heavy),
        walls=Walls(
            spacing=walls["spacing"],
            area=walls["area"],
            sphere=_statistics_of(walls["sphere"]),
            ray=_statistics_of(walls["ray"]),
            edge=Count(*walls["edge"]),
            inner=Count(*walls["inner"]),
            missed=walls["missed"],
            slack=walls["slack"],
        ),
        samples=WallSamples(**{name: _frozen(values) for name, values in walls["samples"].items()}),
        _surface=surface,
    )


def _heavy(found: Mapping[str, Any]) -> HeavySections:
    sections = tuple(
        HeavySection(s["point"], Bounds(*s["depth"]), Bounds(*s["volume"]), s["box"], s["centroid"], s["certain"])
        for s in found["sections"]
    )
    return HeavySections(found["depth"], sections, found["joined"], found["resolution"])


def _statistics_of(found: Mapping[str, Any] | None) -> Statistics | None:
    if found is None:
        return None
    fields: dict[str, Any] = dict(found)
    fields["minimum"], fields["maximum"] = Extreme(*found["minimum"]), Extreme(*found["maximum"])
    fields["percentiles"] = dict(zip(_PERCENTILES, found["percentiles"], strict=True))
    return Statistics(**fields)


def _statistics(found: Statistics | None) -> dict[str, Any] | None:
    if found is None:
        return None
    document = asdict(found)
    document["percentiles"] = {str(name): value for name, value in found.percentiles.items()}
    return document


def _section(section: HeavySection) -> dict[str, Any]:
    document = asdict(section)
    document["thickness"] = {name: 2.0 * value for name, value in document["depth"].items()}
    document["box"] = {"min": section.box[0], "max": section.box[1]}
    return document


def _frozen(values: NDArray[Any]) -> NDArray[Any]:
    values.flags.writeable = False
    return values


def _length(name: str, value: object) -> float:
    try:
        length = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise TruefieldError(f"{name} is {value!r}; give a positive length") from None
    if not (math.isfinite(length) and length > 0.0):
        raise TruefieldError(f"{name} is {value!r}; give a positive length, in model units")
    return length


def _place(point: Point) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in point) + ")"
