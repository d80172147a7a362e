"""Triangle meshes as plain, immutable data."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield import _truefield, arguments
from truefield.check import MeshCheck
from truefield.errors import TruefieldError
from truefield.files import PathLike, replacing

Array = NDArray[np.float64]
_Scalar = TypeVar("_Scalar", bound=np.generic)
_MOST_VERTICES: Final = 2**32 - 1


class TriangleMesh:
    """Vertices and triangles, checked once: at least one triangle with an area, finite vertices, indices in range.

    Nothing is merged, dropped, reordered or turned. Both arrays are copies, C-contiguous and read-only.

    Args:
        vertices: (n, 3), x, y, z in model units.
        triangles: (m, 3) vertex indices, counter-clockwise seen from outside.
        name: what messages and reports call the part.

    Raises:
        TruefieldError: the arrays are no mesh; the sentence names the vertex or triangle at fault.
    """

    __slots__ = ("_extent", "_name", "_triangles", "_vertices")

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike, name: str = "mesh") -> None:
        """Checks and copies the arrays."""
        points = _points(vertices).copy()
        self._take(points, np.array(_indices(triangles, len(points)), np.int64, order="C", copy=True), str(name))

    @classmethod
    def checked(cls, vertices: Array, triangles: NDArray[np.int64], name: str) -> TriangleMesh:
        """A mesh of arrays that nobody else holds: checked as any other, but kept without a copy."""
        mesh = cls.__new__(cls)
        mesh._take(_points(vertices), _indices(triangles, len(vertices)), name)
        return mesh

    def _take(self, vertices: Array, triangles: NDArray[np.int64], name: str) -> None:
        self._name, self._vertices, self._triangles = name, _frozen(vertices), _frozen(triangles)
        self._extent = _extent(vertices, triangles)

    @classmethod
    def trusted(
        cls, vertices: Array, triangles: NDArray[np.int64], lower: Array, upper: Array, name: str
    ) -> TriangleMesh:
        """A mesh of arrays that the core has made and checked, kept without a copy, with the box of its triangles."""
        mesh = cls.__new__(cls)
        mesh._name, mesh._vertices, mesh._triangles = name, _frozen(vertices), _frozen(triangles)
        mesh._extent = _frozen(lower), _frozen(upper)
        return mesh

    @property
    def name(self) -> str:
        """What messages and reports call the part."""
        return self._name

    @property
    def vertices(self) -> Array:
        """(n, 3) float64 positions in model units."""
        return self._vertices

    @property
    def triangles(self) -> NDArray[np.int64]:
        """(m, 3) int64 vertex indices, so that differences and products of indices cannot wrap."""
        return self._triangles

    @property
    def extent(self) -> tuple[Array, Array]:
        """The lower and upper corner, each (3,), of the box of all triangles; unused vertices do not count."""
        return self._extent

    @property
    def corners(self) -> Array:
        """(m, 3, 3) corner positions: a fresh array, indexed [triangle, corner, axis]."""
        return self._vertices[self._triangles]

    def check(self, *, threads: int | None = None, progress: Callable[[str, float], None] | None = None) -> MeshCheck:
        """Looks for everything that can be wrong with a mesh; repairs nothing.

        Vertices at the same position count as one, for this report only. Takes about a microsecond a triangle, more
        where very many triangles cross.
        """
        found = _truefield.check_mesh(self._vertices, self._triangles, threads, progress)
        return MeshCheck.of(found)

    def weld(self, within: float) -> TriangleMesh:
        """A new mesh in which vertices that nearly coincide are one: a repair, done only because you ask for it.

        Vertices joined by a chain of steps of at most `within` (model units) become the first of them. Vertices are
        renumbered, triangles are not: those that lose an edge stay, with zero area.

        Raises:
            TruefieldError: `within` is no finite length, or nothing of the surface would be left.
        """
        if not 0.0 <= within < np.inf:
            raise TruefieldError(f"within is {within}; give a finite length in model units, not negative")
        from truefield.weld import leaders

        leader = leaders(self._vertices, within)
        kept = np.flatnonzero(leader == np.arange(len(leader)))
        return TriangleMesh(self._vertices[kept], np.searchsorted(kept, leader)[self._triangles], self._name)

    def write(self, path: PathLike) -> None:
        """Writes the mesh; the suffix chooses the format.

        `.stl` binary (float32: the only one that rounds), `.ply` binary little endian with double vertices,
        `.obj` and `.off` text with digits enough to read the same floats back. The file appears whole or not at all.

        Raises:
            FileError: the suffix is unknown or the file cannot be written.
        """
        from truefield import formats

        formats.check(path)
        with replacing(path) as stream:
            formats.encode(self, path, stream)

    def __repr__(self) -> str:
        """Name and counts."""
        return f"TriangleMesh({self._name!r}, {len(self._vertices)} vertices, {len(self._triangles)} triangles)"

    def __reduce__(self) -> tuple[type[TriangleMesh], tuple[Array, NDArray[np.int64], str]]:
        """Pickles through the constructor, so that the copy is checked and read-only too."""
        return TriangleMesh, (self._vertices, self._triangles, self._name)


def _points(vertices: ArrayLike) -> Array:
    try:
        points = arguments.real(vertices)
    except (TypeError, ValueError):
        raise TruefieldError("vertices cannot be turned into numbers; give an array of shape (n, 3)") from None
    if points.ndim != 2 or points.shape[1] != 3:
        raise TruefieldError(f"vertices has shape {points.shape}; give an array of shape (n, 3)")
    if len(points) == 0:
        raise TruefieldError("the mesh has no vertices; give at least three")
    if len(points) > _MOST_VERTICES:
        raise TruefieldError(f"the mesh has {len(points)} vertices, more than 2^32 - 1; split it")
    if not np.isfinite(points).all():
        finite = np.isfinite(points).all(axis=1)
        index = int(np.argmin(finite))
        x, y, z = points[index].tolist()
        raise TruefieldError(
            f"vertex {index} is ({x}, {y}, {z}), one of {int((~finite).sum())} that are not finite; "
            "all vertices must be finite numbers"
        )
    return points


def _indices(triangles: ArrayLike, count: int) -> NDArray[Any]:
    try:
        given = np.asarray(triangles)
    except ValueError as error:
        raise TruefieldError(f"triangles is no array ({error}); give vertex indices of shape (m, 3)") from None
    if given.size == 0:
        raise TruefieldError("the mesh has no triangles; give it at least one")
    if given.ndim != 2 or given.shape[1] != 3:
        raise TruefieldError(f"triangles has shape {given.shape}; give vertex indices of shape (m, 3)")
    if given.dtype.kind not in "iu":
        raise TruefieldError(f"triangles has dtype {given.dtype}; give integer vertex indices of shape (m, 3)")
    if given.min() < 0 or given.max() >= count:
        index = int(np.argmax(((given < 0) | (given >= count)).any(axis=1)))
        raise TruefieldError(
            f"triangle {index} refers to vertices {given[index].tolist()} but the mesh has only {count} vertices "
            f"(0 to {count - 1})"
        )
    return given


def _extent(vertices: Array, triangles: NDArray[np.int64]) -> tuple[Array, Array]:
    used = np.zeros(len(vertices), dtype=bool)
    used[triangles] = True
    there = vertices if used.all() else vertices[used]
    lower, upper = there.min(axis=0), there.max(axis=0)
    with np.errstate(over="ignore"):
        diagonal = float(np.linalg.norm(upper - lower))
    if not 0.0 < diagonal < np.inf:
        raise TruefieldError(
            f"the mesh spans a box with a diagonal of {diagonal}; it must have a positive, finite extent"
        )
    # The first few nearly always have an area.
    if not any(_has_area(vertices[some]) for some in (triangles[:64], triangles[64:])):
        raise TruefieldError(f"all {len(triangles)} triangles of the mesh have zero area; it has no surface")
    return _frozen(lower), _frozen(upper)


def _has_area(corners: Array) -> bool:
    """Whether any of (m, 3, 3) triangles has an area."""
    # An overflow gives infinity or, of two, NaN: neither is zero, and both come from corners apart.
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).any())


def _frozen(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    array.flags.writeable = False
    return array
