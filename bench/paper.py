"""What the papers measured, as facts to print beside ours.

Huang, Li, Crawfis, Lu, Liou: A Complete Distance Field Representation, IEEE Visualization 2001, Tables 2 to 7,
on an SGI Octane with one 300 MHz processor; and the engine of the technical report of the same name (Huang, Li,
Crawfis, Lu), whose contour at 10 mm and 0.1 mm tolerance took 30 s on a field of resolution 300. Wavefronts: those of
*Bounded distance transforms of trimmed NURBS*.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class FieldFacts:
    """A row of Tables 2 to 4: a field of one model at one resolution. Cells are in thousands."""

    table: int
    shape: str
    resolution: int
    cells: tuple[int, int, int]
    seconds: float
    kilobytes: int
    inside: float
    surface: float
    outside: float
    surface_mean: float
    inside_mean: float


@dataclass(frozen=True)
class ContourFacts:
    """A cell of Tables 5 to 7: a contour from one field at one accuracy.

    The accuracy is that of a conventional volume with `accuracy` samples along the longest side; the tolerance is
    taken as one such sample's spacing.
    """

    shape: str
    depth: float
    resolution: int
    accuracy: int
    seconds: float
    microseconds_per_point: float


FIELDS = (
    FieldFacts(2, "cube", 32, (32, 32, 32), 2.50, 213, 9.2, 5.7, 17.8, 1.29, 2.47),
    FieldFacts(2, "tetrahedron", 32, (32, 32, 32), 0.59, 64, 1.0, 2.3, 29.5, 1.14, 2.19),
    FieldFacts(2, "one_ended_tooth", 32, (20, 32, 32), 0.79, 94, 2.6, 3.7, 14.2, 1.45, 2.58),
    FieldFacts(2, "six_pointed_star", 32, (15, 29, 32), 0.99, 52, 0.5, 2.1, 11.3, 2.17, 4.30),
    FieldFacts(3, "cube", 64, (64, 64, 64), 34.24, 2438, 148.9, 29.4, 83.8, 1.13, 2.23),
    FieldFacts(3, "tetrahedron", 64, (64, 64, 64), 3.59, 606, 20.8, 10.6, 230.7, 1.06, 2.07),
    FieldFacts(3, "one_ended_tooth", 64, (36, 64, 64), 11.36, 966, 50.0, 18.5, 80.0, 1.20, 2.27),
    FieldFacts(3, "six_pointed_star", 64, (28, 61, 64), 3.97, 398, 13.8, 9.8, 62.4, 1.49, 2.88),
    FieldFacts(4, "connector", 128, (128, 43, 58), 8.05, 970, 26.4, 20.8, 272.0, 1.95, 2.91),
    FieldFacts(4, "connector", 256, (256, 81, 112), 82.72, 7548, 30.7, 91.5, 1924.0, 1.43, 2.53),
    FieldFacts(4, "brevi", 128, (56, 52, 128), 51.53, 3459, 100.4, 50.5, 221.7, 3.01, 4.66),
    FieldFacts(4, "brevi", 256, (106, 98, 256), 448.2, 25260, 1075.4, 205.2, 1379.0, 1.96, 3.69),
)


@dataclass(frozen=True)
class WavefrontFacts:
    """A row of Table 1 of *Bounded distance transforms of trimmed NURBS*, voxels; milliseconds on a 2.4 GHz Xeon.

    The paper does not say how many boundary voxels there were; these are what `voxelize` finds of the public models.
    """

    model: str
    shape: tuple[int, int, int]
    boundary: int
    scipy: float
    processor: float


WAVEFRONTS = (
    WavefrontFacts("cessna", (60, 15, 65), 2_900, 177.125, 50.343),
    WavefrontFacts("cessna", (121, 31, 129), 12_521, 3362.717, 681.029),
    WavefrontFacts("cessna", (239, 61, 257), 53_612, 80857.726, 9433.467),
    WavefrontFacts("bunny", (65, 64, 50), 13_630, 7933.000, 248.810),
    WavefrontFacts("bunny", (129, 128, 100), 55_495, 245197.011, 3477.55),
    WavefrontFacts("bunny", (257, 255, 200), 222_515, 8262842.943, 58884.615),
    WavefrontFacts("armadillo", (55, 65, 39), 9_622, 2225.283, 152.657),
    WavefrontFacts("armadillo", (109, 129, 77), 39_454, 59111.559, 1801.178),
    WavefrontFacts("armadillo", (217, 257, 152), 160_009, 1823702.939, 30004.649),
)

_SIMPLE = (128, 192, 384)
_PARTS = (512, 768, 1024)


def _contours(
    shape: str, depth: float, accuracies: tuple[int, ...], rows: dict[int, tuple[tuple[float, ...], tuple[float, ...]]]
) -> tuple[ContourFacts, ...]:
    return tuple(
        ContourFacts(shape, depth, resolution, accuracy, seconds, micro)
        for resolution, (times, points) in rows.items()
        for accuracy, seconds, micro in zip(accuracies, times, points, strict=True)
    )


# Tables 5 and 7 (times), 6 and 7 (microseconds a point), by resolution of the field.
CONTOURS = (
    *_contours("cube", 0.6, _SIMPLE, {
        32: ((1.13, 3.96, 29.66), (11.74, 18.49, 34.36)),
        64: ((0.84, 1.95, 14.48), (6.42, 6.61, 12.37)),
    }),
    *_contours("tetrahedron", 0.1, _SIMPLE, {
        32: ((0.22, 0.55, 4.02), (11.98, 12.91, 19.63)),
        64: ((0.15, 0.29, 1.61), (4.72, 4.99, 6.92)),
    }),
    *_contours("one_ended_tooth", 0.2, _SIMPLE, {
        32: ((0.73, 2.15, 14.79), (15.17, 19.80, 27.10)),
        64: ((0.43, 1.61, 7.75), (5.09, 10.93, 13.56)),
    }),
    *_contours("six_pointed_star", 0.35, _SIMPLE, {
        32: ((0.54, 1.53, 12.23), (34.03, 43.83, 78.36)),
        64: ((0.22, 0.61, 4.30), (10.37, 12.80, 20.41)),
    }),
    *_contours("connector", 0.3, _PARTS, {
        128: ((2.43, 7.12, 16.92), (24.08, 30.92, 41.45)),
        256: ((1.03, 2.69, 5.67), (9.88, 11.00, 13.38)),
    }),
    *_contours("brevi", 4.0, _PARTS, {
        128: ((23.66, 74.65, 174.79), (32.51, 45.27, 59.72)),
        256: ((9.25, 28.29, 64.46), (12.23, 16.63, 21.36)),
    }),
)  # fmt: skip

# The technical report's engine: seconds for the contour alone, from a field of resolution 300.
ENGINE_SECONDS = 30.0
