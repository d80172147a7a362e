"""Points with normals: what a contour is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield.errors import TruefieldError
from truefield.files import PathLike

_Scalar = TypeVar("_Scalar", bound=np.generic)
_RESERVED = ("x", "y", "z", "nx", "ny", "nz", "triangle")


class PointCloud:
    """Points, each with a unit normal, the triangle it belongs to and any scalars. Arrays are read-only.

    Args:
        points: (n, 3), x, y, z in model units.
        normals: (n, 3) unit vectors, or None.
        triangle: (n,) index of the nearest triangle, or None.
        scalars: further values by name, each (n,), as `{"thickness": ...}`.

    Raises:
        TruefieldError: an array has the wrong shape or a name is taken.
    """

    __slots__ = ("_normals", "_points", "_scalars", "_triangle")

    def __init__(
        self,
        points: ArrayLike,
        normals: ArrayLike | None = None,
        triangle: ArrayLike | None = None,
        scalars: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Checks the arrays; those of the right type already are not copied."""
        self._points = _vectors("points", points)
        count = len(self._points)
        self._normals = None if normals is None else _vectors("normals", normals, count)
        self._triangle = None if triangle is None else _column("triangle", np.asarray(triangle, dtype=np.int64), count)
        for name in scalars or {}:
            if name in _RESERVED or not name.isidentifier():
                raise TruefieldError(
                    f"a scalar is called {name!r}; give it a plain name other than {', '.join(_RESERVED)}"
                )
        self._scalars = {name: _column(name, np.asarray(values), count) for name, values in (scalars or {}).items()}

    @property
    def points(self) -> NDArray[np.float64]:
        """(n, 3) float64 positions in model units."""
        return self._points

    @property
    def normals(self) -> NDArray[np.float64] | None:
        """(n, 3) float64 unit normals, or None."""
        return self._normals

    @property
    def triangle(self) -> NDArray[np.int64] | None:
        """(n,) int64 index of the nearest triangle of the part, or None."""
        return self._triangle

    @property
    def scalars(self) -> dict[str, NDArray[np.generic]]:
        """Further values by name, each (n,)."""
        return dict(self._scalars)

    def __len__(self) -> int:
        """The number of points."""
        return len(self._points)

    def __repr__(self) -> str:
        """Count and columns."""
        return f"PointCloud({len(self)} points: {', '.join(self._columns())})"

    def write(self, path: PathLike) -> None:
        """Writes all columns; the suffix chooses the format. The file appears whole or not at all.

        `.ply` binary little endian: `x y z nx ny nz triangle` and the scalars, float64 as double, int64 indices as int;
        `.csv` the same columns with a line of names; `.xyz` blanks between, positions and normals only.

        Raises:
            FileError: the suffix is unknown or the file cannot be written.
        """
        from truefield.formats import table

        table.write(path, self._columns())

    def _columns(self) -> dict[str, NDArray[np.generic]]:
        columns: dict[str, NDArray[np.generic]] = dict(zip("xyz", self._points.T, strict=True))
        if self._normals is not None:
            columns |= dict(zip(("nx", "ny", "nz"), self._normals.T, strict=True))
        if self._triangle is not None:
            columns["triangle"] = self._triangle.astype(np.uint32)
        return columns | self._scalars


def _vectors(name: str, values: ArrayLike, count: int | None = None) -> NDArray[np.float64]:
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or (count is not None and len(array) != count):
        rows = "n" if count is None else str(count)
        raise TruefieldError(f"{name} has shape {array.shape}; give an array of shape ({rows}, 3)")
    return _read_only(array)


def _column(name: str, values: NDArray[_Scalar], count: int) -> NDArray[_Scalar]:
    if values.shape != (count,):
        raise TruefieldError(f"{name} has shape {values.shape}; give one value for each of the {count} points")
    if values.dtype.kind not in "iuf":
        raise TruefieldError(f"{name} has dtype {values.dtype}; give real numbers")
    return _read_only(values)


def _read_only(array: NDArray[_Scalar]) -> NDArray[_Scalar]:
    view: NDArray[_Scalar] = array.view()
    view.flags.writeable = False
    return view
