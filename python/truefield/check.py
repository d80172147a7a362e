"""What is right and what is wrong with a mesh, as numbers and as sentences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

# Field, its name for one and for many, what it means, and what its indices name.
_PROBLEMS = (
    ("open_edges", "open edge", "open edges", "where the surface has a hole or crack", "vertices"),
    ("non_manifold_edges", "non-manifold edge", "non-manifold edges", "where more than two triangles meet", "vertices"),
    ("inconsistent_edges", "flipped edge", "flipped edges", "whose two triangles face opposite ways", "vertices"),
    ("pinched_vertices", "pinched vertex", "pinched vertices", "where separate pieces touch", "vertex"),
    ("duplicate_triangles", "duplicate triangle", "duplicate triangles", "facing the same way", "triangles"),
    ("opposite_triangles", "pair of triangles", "pairs of triangles", "on the same corners back to back", "triangles"),
    ("zero_area_triangles", "zero-area triangle", "zero-area triangles", "whose corners lie on a line", "triangle"),
    ("self_intersections", "crossing", "crossings", "where triangles meet beyond what they share", "triangles"),
    ("inside_out_shells", "inside-out shell", "inside-out shells", "with normals pointing inward", "of triangle"),
    ("nested_shells", "nested shell", "nested shells", "in a solid and facing the same way", "of triangle"),
    ("uncertain_shells", "uncertain shell", "uncertain shells", "too near to others to be placed", "of triangle"),
    ("unreferenced_vertices", "unused vertex", "unused vertices", "that no triangle refers to", "vertex"),
)


@dataclass(frozen=True)
class Finding:
    """How many of something there are, and the indices of the first few: of edges, their two vertices."""

    count: int
    first: tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class MeshCheck:
    """What `TriangleMesh.check` found. Vertices at the same position count as one here; nothing is repaired.

    Edges are named by their two vertices, shells by their lowest triangle.
    """

    open_edges: Finding
    """Edges of one triangle only: borders of holes and cracks."""
    non_manifold_edges: Finding
    """Edges of more than two triangles."""
    inconsistent_edges: Finding
    """Edges of two triangles that face opposite ways: one of them is flipped."""
    pinched_vertices: Finding
    """Vertices where pieces of surface meet that share no edge there."""
    duplicate_triangles: Finding
    """Triangles over the same corners that face the same way: the first and a later one."""
    opposite_triangles: Finding
    """Triangles over the same corners that face opposite ways."""
    zero_area_triangles: Finding
    """Triangles with no area, up to rounding."""
    unreferenced_vertices: Finding
    """Vertices that no triangle uses."""
    self_intersections: Finding
    """Pairs of triangles that meet beyond the corner or edge they share."""
    self_intersections_complete: bool
    """False where there are so many that not all were counted."""
    shells: int
    """Pieces joined by shared edges."""
    inside_out_shells: Finding
    """Closed shells whose normals point into the solid."""
    nested_shells: Finding
    """Closed shells inside a solid that face the same way as it."""
    uncertain_shells: Finding
    """Closed shells for which neither could be told: others are too near."""
    watertight: bool
    """Every edge belongs to two triangles, or to an even number more."""
    consistent: bool
    """Neighbours run opposite ways along every edge, so that normals agree."""
    volume: float
    """Signed, cubic model units, positive where normals point outward; a volume only if watertight."""
    area: float
    """Square model units, duplicates included."""

    @classmethod
    def of(cls, found: Mapping[str, Any]) -> MeshCheck:
        """From what the compiled check says: finds as `(count, first)`, all else as it is."""
        fields: dict[str, Any] = dict(found)
        for name, value in found.items():
            if isinstance(value, tuple):
                count, first = value
                fields[name] = Finding(count, tuple(map(tuple, first)))
        return cls(**fields)

    def problems(self) -> list[str]:
        """One sentence for each thing wrong, with the place of the first; empty if all is well."""
        sentences = []
        for name, one, many, meaning, place in _PROBLEMS:
            finding: Finding = getattr(self, name)
            if not finding.count:
                continue
            partly = name == "self_intersections" and not self.self_intersections_complete
            number = f"at least {finding.count}" if partly else f"{finding.count}"
            where = f"{place} {' and '.join(map(str, finding.first[0]))}"
            first = where if finding.count == 1 else f"the first: {where}"
            sentences.append(f"{number} {one if finding.count == 1 else many}, {meaning} ({first})")
        return sentences
