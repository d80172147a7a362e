"""The compiled half of truefield."""

from collections.abc import Callable, Iterator
from typing import Any, Literal, final

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Progress = Callable[[str, float], None] | None
_NearestArrays = tuple[_Floats, _Floats, NDArray[np.int64], NDArray[np.uint8], _Floats]

__all__ = [
    "AdaptiveField",
    "Camera",
    "CompleteField",
    "Distinct",
    "Expression",
    "SampledField",
    "Scene",
    "Shape",
    "Surface",
    "__version__",
    "adaptive_field_from_levels",
    "adaptive_field_levels",
    "adaptive_nearest",
    "adaptive_surface",
    "capsule",
    "cast_rays",
    "check_mesh",
    "collide",
    "complete_field_from_parts",
    "complete_field_parts",
    "contour",
    "cuboid",
    "difference_of",
    "distance_transform",
    "edit_field",
    "ellipsoid",
    "field_outline",
    "frustum",
    "function_shape",
    "half_space",
    "intersection_of",
    "level_of_detail",
    "march",
    "menger_sponge",
    "merged_samples",
    "molecule",
    "occluded_rays",
    "patch_shape",
    "polygon",
    "render_field",
    "sample",
    "sample_marched",
    "site_difference",
    "site_indices",
    "skewed_bounds",
    "skewed_transform",
    "sphere",
    "sweep",
    "thickness",
    "torus",
    "transform_bounds",
    "tube",
    "union_of",
    "voxelize",
    "walls_at",
    "wavefront",
]

__version__: str

# Shape, sampling, periodic axes, target, border, surface, memory.
_Asked = tuple[list[int], list[float], list[bool], str, str, str, int]

def distance_transform(
    image: NDArray[Any],
    asked: _Asked,
    out: NDArray[np.float32],
    sites: NDArray[np.uint32] | NDArray[np.uint64] | None = None,
    threads: int | None = None,
    progress: _Progress = None,
) -> None: ...
def transform_bounds(
    image: NDArray[Any],
    asked: _Asked,
    lower: NDArray[np.float32],
    upper: NDArray[np.float32],
    threads: int | None = None,
    progress: _Progress = None,
) -> None: ...

# Shape, steps, target, surface, memory.
_AskedSkewed = tuple[list[int], list[list[float]], str, str, int]

def skewed_transform(
    image: NDArray[Any],
    asked: _AskedSkewed,
    out: NDArray[np.float32],
    sites: NDArray[np.uint32] | NDArray[np.uint64] | None = None,
    threads: int | None = None,
    progress: _Progress = None,
) -> None: ...
def skewed_bounds(
    image: NDArray[Any],
    asked: _AskedSkewed,
    centres: NDArray[np.float32],
    lower: NDArray[np.float32],
    upper: NDArray[np.float32],
    threads: int | None = None,
    progress: _Progress = None,
) -> None: ...
def site_indices(
    sites: NDArray[np.uint32] | NDArray[np.uint64],
    shape: list[int],
    out: NDArray[np.int32] | NDArray[np.int64],
    threads: int | None = None,
    progress: _Progress = None,
) -> None: ...

@final
class Distinct:
    def __new__(cls) -> Distinct: ...
    def numbers(self, points: _Floats) -> NDArray[np.int64]: ...
    def take(self) -> _Floats: ...

def check_mesh(
    vertices: _Floats, triangles: NDArray[np.int64], threads: int | None = None, progress: _Progress = None
) -> dict[str, Any]: ...
def thickness(
    surface: Surface,
    tolerance: float,
    above: float | None = None,
    below: float | None = None,
    spacing: float | None = None,
    threads: int | None = None,
    progress: _Progress = None,
) -> dict[str, Any]: ...
def walls_at(
    surface: Surface,
    points: _Floats,
    triangles: NDArray[np.int64],
    tolerance: float,
    largest: float,
    threads: int | None = None,
    progress: _Progress = None,
) -> tuple[_Floats, NDArray[np.uint8]]: ...

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
    def first(self) -> list[int]: ...
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
        values: NDArray[np.float32],
        origin: list[float],
        spacing: list[float],
        error: float | None = None,
        lower: NDArray[np.float32] | None = None,
        upper: NDArray[np.float32] | None = None,
        band: float | None = None,
        doubtful: NDArray[np.uint64] | None = None,
        continuous: bool = True,
    ) -> SampledField: ...
    @property
    def lattice(self) -> tuple[list[float], list[float], tuple[int, int, int]]: ...
    @property
    def values(self) -> NDArray[np.float32]: ...
    @property
    def lower(self) -> NDArray[np.float32]: ...
    @property
    def upper(self) -> NDArray[np.float32]: ...
    @property
    def known(self) -> tuple[str, float, NDArray[np.uint64]]: ...
    @property
    def continuous(self) -> bool: ...
    def distance(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _Floats: ...
    def bounds(
        self, points: _Floats, threads: int | None = None, progress: _Progress = None
    ) -> tuple[_Floats, _Floats]: ...
    def gradient(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _Floats: ...
    def foot(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _Floats: ...
    def complement(self) -> SampledField: ...
    def offset(
        self, distance: float, memory: int, threads: int | None = None, progress: _Progress = None
    ) -> SampledField: ...
    def combine(
        self, name: str, other: SampledField, memory: int, threads: int | None = None, progress: _Progress = None
    ) -> SampledField: ...
    def surface(
        self,
        distance: float,
        border: str,
        memory: int,
        threads: int | None = None,
        progress: _Progress = None,
    ) -> tuple[_Floats, NDArray[np.int64], list[float], list[float]]: ...
    def contour(
        self,
        distance: float,
        tolerance: float,
        placement: str,
        memory: int,
        threads: int | None = None,
        progress: _Progress = None,
    ) -> tuple[_Floats, _Floats, _Floats, _Floats]: ...
    def medial_axis(
        self, side: str, angle: float, threads: int | None = None, progress: _Progress = None
    ) -> tuple[_Floats, _Floats, _Floats]: ...
    def resample(
        self,
        origin: list[float],
        spacing: list[float],
        shape: tuple[int, int, int],
        memory: int,
        threads: int | None = None,
        progress: _Progress = None,
    ) -> SampledField: ...

@final
class Camera:
    def __new__(
        cls,
        points: _Floats,
        view: str | None = None,
        direction: tuple[float, float, float] | None = None,
        up: tuple[float, float, float] | None = None,
        field_of_view: float | None = None,
        margin: float = 0.06,
    ) -> Camera: ...
    @property
    def forward(self) -> tuple[float, float, float]: ...
    @property
    def eye(self) -> tuple[float, float, float]: ...
    @property
    def span(self) -> tuple[float, float]: ...
    def project(self, points: _Floats, width: int, height: int) -> _Floats: ...

@final
class Scene:
    def __new__(cls) -> Scene: ...
    def add_mesh(
        self,
        vertices: _Floats,
        triangles: NDArray[np.int64],
        colours: NDArray[np.uint8],
        per: str = "whole",
        values: _Floats | None = None,
        span: tuple[float, float] | None = None,
        finish: str = "satin",
        opacity: float = 1.0,
        ink: tuple[tuple[int, int, int], float, float] | None = None,
    ) -> None: ...
    def add_sampled_mesh(
        self,
        vertices: _Floats,
        triangles: NDArray[np.int64],
        points: _Floats,
        normals: _Floats,
        values: _Floats,
        colours: NDArray[np.uint8],
        span: tuple[float, float],
        finish: str = "chart",
        ink: tuple[tuple[int, int, int], float, float] | None = None,
    ) -> None: ...
    def add_points(
        self,
        points: _Floats,
        normals: _Floats,
        colours: NDArray[np.uint8],
        per: str = "whole",
        values: _Floats | None = None,
        span: tuple[float, float] | None = None,
        finish: str = "satin",
        radius: float | None = None,
    ) -> None: ...
    def add_balls(
        self,
        centers: _Floats,
        radii: _Floats,
        colours: NDArray[np.uint8],
        per: str = "whole",
        values: _Floats | None = None,
        span: tuple[float, float] | None = None,
        finish: str = "polished",
        opacity: float = 1.0,
    ) -> None: ...
    @property
    def extent(self) -> tuple[_Floats, _Floats] | None: ...
    def render(
        self,
        camera: Camera,
        width: int,
        height: int,
        samples: int = 9,
        background: tuple[int, int, int] | None = None,
        occlusion: float = 0.0,
        threads: int | None = None,
        progress: _Progress = None,
    ) -> tuple[NDArray[np.uint8], NDArray[np.float32]]: ...

def sample(
    surface: Surface,
    origin: list[float],
    spacing: float,
    shape: tuple[int, int, int],
    band: float | None,
    memory: int,
    threads: int | None = None,
    progress: _Progress = None,
) -> SampledField: ...
def sample_marched(
    surface: Surface,
    origin: list[float],
    spacing: float,
    shape: tuple[int, int, int],
    band: float | None,
    memory: int,
    threads: int | None = None,
    progress: _Progress = None,
) -> SampledField: ...
def voxelize(
    surface: Surface,
    origin: list[float],
    spacing: float,
    shape: tuple[int, int, int],
    rule: str,
    memory: int,
    threads: int | None = None,
    progress: _Progress = None,
) -> tuple[NDArray[np.bool_], NDArray[np.int64], NDArray[np.int64], _Floats, int]: ...
def wavefront(
    sites: NDArray[np.bool_],
    shape: list[int],
    sampling: list[float],
    memory: int,
    threads: int | None = None,
    progress: _Progress = None,
) -> tuple[NDArray[np.uint32], NDArray[np.float32], NDArray[np.uint64]]: ...
def march(
    sites: NDArray[np.bool_], shape: list[int], sampling: list[float], memory: int, progress: _Progress = None
) -> tuple[NDArray[np.uint32], NDArray[np.float32]]: ...
def site_difference(
    marched: NDArray[np.uint32],
    exact: NDArray[np.uint32],
    shape: list[int],
    sampling: list[float],
    threads: int | None = None,
    progress: _Progress = None,
) -> tuple[int, float]: ...
def contour(
    surface: Surface,
    distance: float,
    tolerance: float,
    placement: str,
    memory: int,
    threads: int | None = None,
    progress: _Progress = None,
) -> tuple[_Floats, _Floats, NDArray[np.int64]]: ...
def complete_field_parts(
    field: CompleteField, threads: int | None = None, progress: _Progress = None
) -> dict[str, NDArray[Any]]: ...
def complete_field_from_parts(
    surface: Surface,
    origin: list[float],
    cell_size: float,
    first: list[int],
    shape: list[int],
    region: str,
    parts: dict[str, NDArray[Any]],
    threads: int | None = None,
    progress: _Progress = None,
) -> CompleteField: ...

@final
class Expression:
    @staticmethod
    def axes() -> list[Expression]: ...
    @staticmethod
    def constant(value: float) -> Expression: ...
    def unary(self, name: str) -> Expression: ...
    def binary(self, name: str, other: Expression) -> Expression: ...
    def power(self, exponent: int) -> Expression: ...
    def evaluate(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _Floats: ...
    def shape(
        self, low: list[float], high: list[float], threads: int | None = None, progress: _Progress = None
    ) -> Shape: ...

def function_shape(
    function: object, lipschitz: float, domain: tuple[list[float], list[float]] | None, values: str
) -> Shape: ...
def patch_shape(controls: _Floats, sides: str, threads: int | None = None, progress: _Progress = None) -> Shape: ...

@final
class Shape:
    @staticmethod
    def mesh(surface: Surface) -> Shape: ...
    @staticmethod
    def field(field: AdaptiveField) -> Shape: ...
    def complement(self) -> Shape: ...
    def translate(self, by: list[float]) -> Shape: ...
    def rotate(self, axis: list[float], degrees: float) -> Shape: ...
    def scale(self, factor: float) -> Shape: ...
    def offset(self, distance: float) -> Shape: ...
    def shell(self, thickness: float) -> Shape: ...
    def blend(self, other: Shape, radius: float, kind: str) -> Shape: ...
    @property
    def extent(self) -> tuple[list[float], list[float]] | None: ...
    def distance(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _Floats: ...
    def bounds(
        self, points: _Floats, threads: int | None = None, progress: _Progress = None
    ) -> tuple[_Floats, _Floats]: ...
    def gradient(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _Floats: ...

def sphere(radius: float, center: list[float]) -> Shape: ...
def cuboid(size: list[float], radius: float, center: list[float]) -> Shape: ...

@final
class AdaptiveField:
    def __new__(
        cls,
        shape: Shape,
        tolerance: float,
        growth: float,
        max_depth: int,
        domain: tuple[list[float], list[float]] | None,
        method: str,
        rule: str,
        memory: int,
        threads: int | None = None,
        progress: _Progress = None,
    ) -> AdaptiveField: ...
    @staticmethod
    def of_surface(
        surface: Surface,
        tolerance: float,
        growth: float,
        max_depth: int,
        domain: tuple[list[float], list[float]] | None,
        method: str,
        rule: str,
        memory: int,
        threads: int | None = None,
        progress: _Progress = None,
    ) -> AdaptiveField: ...
    @property
    def children(self) -> int: ...
    @property
    def mesh(self) -> tuple[_Floats, NDArray[np.int64], str] | None: ...
    @property
    def extent(self) -> tuple[list[float], list[float]]: ...
    def leaves(self) -> tuple[_Floats, _Floats, _Floats, _Floats]: ...
    def statistics(self) -> dict[str, int]: ...
    def distance(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _Floats: ...
    def bounds(
        self, points: _Floats, threads: int | None = None, progress: _Progress = None
    ) -> tuple[_Floats, _Floats]: ...
    def gradient(self, points: _Floats, threads: int | None = None, progress: _Progress = None) -> _Floats: ...

def edit_field(
    field: AdaptiveField,
    tool: Shape,
    operation: str,
    radius: float,
    memory: int,
    threads: int | None = None,
    progress: _Progress = None,
) -> AdaptiveField: ...
def level_of_detail(
    field: AdaptiveField,
    tolerance: float | None,
    depth: int | None,
    threads: int | None = None,
    progress: _Progress = None,
) -> AdaptiveField: ...
def merged_samples(
    samples: SampledField,
    tolerance: float,
    growth: float,
    max_depth: int,
    memory: int,
    threads: int | None = None,
    progress: _Progress = None,
) -> AdaptiveField: ...
def polygon(loops: list[list[list[float]]], fill: str) -> Shape: ...
def adaptive_field_levels(
    field: AdaptiveField, threads: int | None = None, progress: _Progress = None
) -> tuple[dict[str, Any], list[dict[str, NDArray[Any]]]]: ...
def adaptive_field_from_levels(
    about: dict[str, Any],
    levels: Iterator[dict[str, NDArray[Any]]],
    surface: Surface | None,
    threads: int | None = None,
    progress: _Progress = None,
) -> AdaptiveField: ...
def cast_rays(
    field: AdaptiveField,
    origins: _Floats,
    directions: _Floats,
    method: str,
    distance: float,
    threads: int | None = None,
    progress: _Progress = None,
) -> tuple[_Floats, _Floats, _Floats]: ...
def occluded_rays(
    field: AdaptiveField,
    origins: _Floats,
    directions: _Floats,
    length: float,
    method: str,
    distance: float,
    threads: int | None = None,
    progress: _Progress = None,
) -> NDArray[np.bool_]: ...
def adaptive_nearest(
    field: AdaptiveField, points: _Floats, threads: int | None = None, progress: _Progress = None
) -> tuple[_Floats, NDArray[np.int64], NDArray[np.uint8]]: ...
def adaptive_surface(
    field: AdaptiveField,
    distance: float,
    shape: Shape | None,
    memory: int,
    threads: int | None = None,
    progress: _Progress = None,
) -> tuple[_Floats, NDArray[np.int64], list[float], list[float]]: ...
def collide(
    first: Shape | AdaptiveField,
    second: Shape | AdaptiveField,
    tolerance: float,
    budget: int,
    threads: int | None = None,
    progress: _Progress = None,
) -> tuple[
    Literal["separated", "penetrating", "touching or undecided"], float, float, list[float], list[float], int
]: ...
def field_outline(
    field: AdaptiveField, distance: float, threads: int | None = None, progress: _Progress = None
) -> _Floats: ...
def render_field(
    field: AdaptiveField,
    camera: Camera,
    width: int,
    height: int,
    colour: tuple[int, int, int],
    distance: float,
    samples: int = 9,
    background: tuple[int, int, int] | None = None,
    occlusion: float = 0.0,
    threads: int | None = None,
    progress: _Progress = None,
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]: ...
def capsule(start: list[float], end: list[float], radius: float) -> Shape: ...
def half_space(point: list[float], normal: list[float]) -> Shape: ...
def frustum(bottom: float, top: float, height: float, axis: list[float], center: list[float]) -> Shape: ...
def torus(major: float, minor: float, axis: list[float], center: list[float]) -> Shape: ...
def ellipsoid(axes: list[float], center: list[float]) -> Shape: ...
def menger_sponge(level: int, size: float, center: list[float]) -> Shape: ...
def molecule(centers: _Floats, radii: _Floats, sharpness: float) -> Shape: ...
def union_of(shapes: list[Shape]) -> Shape: ...
def intersection_of(shapes: list[Shape]) -> Shape: ...
def difference_of(shape: Shape, others: list[Shape]) -> Shape: ...
def tube(path: _Floats, radius: float) -> Shape: ...
def sweep(tool: Shape, positions: _Floats, turns: _Floats | None) -> Shape: ...
