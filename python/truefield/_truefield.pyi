"""The compiled half of truefield."""

from collections.abc import Callable
from typing import final

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Progress = Callable[[str, float], None] | None
_NearestArrays = tuple[_Floats, _Floats, NDArray[np.int64], NDArray[np.uint8], _Floats]

__all__ = ["CompleteField", "SampledField", "Surface", "__version__"]

__version__: str

@final
class Surface:
    def __new__(
        cls,
        vertices: _Floats,
        triangles: NDArray[np.int64],
        sign: str,
        threads: int | None = None,
        progress: _Progress = None,
    ) -> Surface: ...
    @property
    def sign_rule(self) -> tuple[str, str]: ...
    def distance(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _Floats: ...
    def bounds(
        self, points: _Floats, threads: int | None = None, progress: _Progress = None
    ) -> tuple[_Floats, _Floats]: ...
    def nearest(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _NearestArrays: ...

@final
class CompleteField:
    def __new__(
        cls,
        surface: Surface,
        origin: list[float],
        cell_size: float,
        shape: tuple[int, int, int],
        region: str,
        memory: int,
        threads: int | None = None,
        progress: _Progress = None,
    ) -> CompleteField: ...
    @property
    def surface(self) -> Surface: ...
    @property
    def grid(self) -> tuple[list[float], float, tuple[int, int, int]]: ...
    @property
    def region(self) -> str: ...
    def statistics(self) -> dict[str, float]: ...
    def distance(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _Floats: ...
    def bounds(
        self, points: _Floats, threads: int | None = None, progress: _Progress = None
    ) -> tuple[_Floats, _Floats]: ...
    def nearest(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _NearestArrays: ...

@final
class SampledField:
    def __new__(
        cls,
        surface: Surface,
        origin: list[float],
        spacing: float,
        shape: tuple[int, int, int],
        band: float | None,
        memory: int,
        threads: int | None = None,
        progress: _Progress = None,
    ) -> SampledField: ...
    @property
    def lattice(self) -> tuple[list[float], float, tuple[int, int, int]]: ...
    @property
    def values(self) -> NDArray[np.float32]: ...
    @property
    def lower(self) -> NDArray[np.float32]: ...
    @property
    def upper(self) -> NDArray[np.float32]: ...
    def distance(self, points: _Floats) -> _Floats: ...
    def bounds(self, points: _Floats) -> tuple[_Floats, _Floats]: ...
