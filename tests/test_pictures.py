"""Pictures: what they show can be measured, what they say can be read, and bad input is refused in a sentence."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import truefield as tf
from numpy.typing import NDArray
from PIL import Image
from truefield import colours, layout, lettering, pictures
from truefield._truefield import Camera, Scene

SMALL = (240, 180)
CUBE_QUADS = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]


def cube() -> tf.TriangleMesh:
    corners = [[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]
    return tf.TriangleMesh(corners, [t for a, b, c, d in CUBE_QUADS for t in ((a, b, c), (a, c, d))], "cube")


def ball_cloud(count: int = 4000) -> tf.PointCloud:
    k = np.arange(count)
    z = 1 - (2 * k + 1) / count
    angle = math.pi * (3 - math.sqrt(5)) * k
    normals = np.stack([np.cos(angle) * np.sqrt(1 - z * z), np.sin(angle) * np.sqrt(1 - z * z), z], axis=1)
    return tf.PointCloud(0.5 + 0.3 * normals, normals)


def pixels(image: Image.Image) -> NDArray[np.int64]:
    return np.asarray(image.convert("RGB")).astype(np.int64)


# Colours ------------------------------------------------------------------------------------------------------------


def test_oklab_is_the_published_space() -> None:
    # White is L = 1 without colour, and the primaries as Ottosson tabulates them.
    known = {
        (255, 255, 255): (1.0, 0.0, 0.0),
        (0, 0, 0): (0.0, 0.0, 0.0),
        (255, 0, 0): (0.62796, 0.22486, 0.12585),
        (0, 255, 0): (0.86644, -0.23389, 0.17950),
        (0, 0, 255): (0.45201, -0.03246, -0.31153),
    }
    for rgb, lab in known.items():
        np.testing.assert_allclose(colours.to_oklab(rgb), lab, atol=2e-4)
        np.testing.assert_allclose(colours.from_oklab(colours.to_oklab(rgb)), rgb, atol=1e-6)


def test_the_colour_map_is_even() -> None:
    lab = colours.even_path(256)
    light = np.diff(lab[:, 0])
    assert light.min() > 0
    assert light.max() / light.min() < 1.0001
    steps = np.linalg.norm(np.diff(lab, axis=0), axis=1)
    assert steps.max() / steps.min() < 1.001
    # From near black to near white.
    assert lab[0, 0] < 0.32
    assert lab[-1, 0] > 0.9
    turn = np.unwrap(np.arctan2(lab[:, 2], lab[:, 1]))
    assert abs(turn[-1] - turn[0]) == pytest.approx(math.radians(200), abs=0.001)


def test_the_colour_map_is_rounded_and_never_clipped() -> None:
    exact = colours.from_oklab(colours.even_path(256))
    assert exact.min() >= 0.0
    assert exact.max() <= 255.0
    steps = colours.even_map(256)
    assert np.abs(steps - exact).max() <= 0.5
    light = colours.to_oklab(steps)[:, 0]
    assert np.diff(light).min() > -0.001
    assert np.diff(light[::4]).min() > 0


def test_values_become_colours_of_the_map() -> None:
    steps = colours.even_map()
    picked = colours.colours_of([1.0, 2.0, 3.0, -5.0, 9.0], 1.0, 3.0)
    np.testing.assert_array_equal(picked, steps[[0, 128, 255, 0, 255]])
    with pytest.raises(tf.TruefieldError, match="at least 2"):
        colours.even_map(1)


def test_colours_that_tell_things_apart_differ() -> None:
    lab = colours.to_oklab(np.array(colours.distinct(12)))
    apart = np.linalg.norm(lab[:, None] - lab[None], axis=2) + np.eye(12)
    assert apart.min() > 0.04
    assert apart[np.arange(11), np.arange(1, 12)].min() > 0.15


# Letters ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (0.0, 10.0, [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]),
        (0.31, 2.9, [0.5, 1.0, 1.5, 2.0, 2.5]),
        (-3.0, 3.0, [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0]),
        (1e-6, 7e-6, [1e-6, 2e-6, 3e-6, 4e-6, 5e-6, 6e-6, 7e-6]),
        (5.0, 5.0, [5.0]),
    ],
)
def test_ticks_are_round(low: float, high: float, expected: list[float]) -> None:
    assert lettering.ticks(low, high) == pytest.approx(expected)


def test_ticks_are_never_too_many() -> None:
    rng = np.random.default_rng(2)
    for _ in range(2000):
        low = float(rng.normal() * 10.0 ** rng.integers(-9, 9))
        high = low + float(10.0 ** rng.uniform(-6, 9)) * max(abs(low), 1e-12)
        most = int(rng.integers(2, 12))
        places = lettering.ticks(low, high, most)
        assert 1 <= len(places) <= most
        assert all(low - 1e-6 * (high - low) <= place <= high + 1e-6 * (high - low) for place in places)
        labels = lettering.tick_labels(places)
        assert len(set(labels)) == len(labels) or high - low < 1e-3 * abs(low)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (23.4567, "23.5"),
        (10.0, "10"),
        (-0.5, "-0.5"),
        (123456.0, "123456"),
        (0.00012, "0.00012"),
        (math.nan, "?"),
    ],
)
def test_numbers_are_rounded_sensibly(value: float, text: str) -> None:
    assert lettering.number(value) == text


# Pictures -----------------------------------------------------------------------------------------------------------


def test_a_part_is_where_it_must_be() -> None:
    image = pictures.part_picture(cube(), view="top", size=(400, 300), background=(255, 255, 255))
    dark = np.asarray(pixels(image).min(axis=2) < 250)
    rows, columns = np.flatnonzero(dark.any(axis=1)), np.flatnonzero(dark.any(axis=0))
    # 6 % margin above and below; a square, in the middle.
    side = 300 * 0.88
    assert len(rows) == pytest.approx(side, abs=4)
    assert len(columns) == pytest.approx(side, abs=4)
    assert columns.mean() == pytest.approx(199.5, abs=1)
    assert dark.sum() == pytest.approx(side * side, rel=0.02)


def test_a_contour_shows_through_the_part_and_without_holes(tmp_path: Path) -> None:
    path = tmp_path / "contour.png"
    image = pictures.contour_picture(cube(), ball_cloud(), path, view="front", size=SMALL)
    assert Image.open(path).size == SMALL == image.size
    np.testing.assert_array_equal(pixels(Image.open(path)), pixels(image))
    red, _, blue = np.moveaxis(pixels(image), 2, 0)
    warm = red - blue > 40
    radius = 0.3 * SMALL[1] * 0.88
    assert warm.sum() == pytest.approx(math.pi * radius**2, rel=0.04)
    y, x = np.mgrid[: SMALL[1], : SMALL[0]]
    inside = np.hypot(x + 0.5 - SMALL[0] / 2, y + 0.5 - SMALL[1] / 2) < 0.93 * radius
    assert warm[inside].all()


def test_a_contour_outside_the_part_fits_into_the_picture() -> None:
    cloud = ball_cloud()
    outside = tf.PointCloud(0.5 + (cloud.points - 0.5) * 5.0, cloud.normals)
    image = pictures.contour_picture(cube(), outside, view="front", size=SMALL)
    border = np.concatenate([pixels(image)[0], pixels(image)[-1], pixels(image)[:, 0], pixels(image)[:, -1]])
    assert (border == 255).all()
    red, _, blue = np.moveaxis(pixels(image), 2, 0)
    assert (red - blue > 40).sum() == pytest.approx(math.pi * (0.44 * SMALL[1]) ** 2, rel=0.04)


def test_a_transparent_background_is_transparent() -> None:
    image = pictures.contour_picture(cube(), ball_cloud(), size=SMALL, background=None)
    assert image.mode == "RGBA"
    alpha = np.asarray(image)[:, :, 3]
    assert alpha[0, 0] == 0
    assert 20 < alpha[SMALL[1] // 2, 40 + SMALL[0] // 4] <= 255
    assert alpha.max() == 255


def test_the_view_may_be_a_direction() -> None:
    part = cube()
    named = pictures.part_picture(part, view="front", size=SMALL)
    np.testing.assert_array_equal(pixels(named), pixels(pictures.part_picture(part, view=(0, 1, 0), size=SMALL)))
    along = pictures.part_picture(part, view=((0.0, 1.0, 0.0), (0.0, 0.0, 3.0)), size=SMALL)
    np.testing.assert_array_equal(pixels(named), pixels(along))
    pictures.part_picture(part, view=(0.0, 0.0, -1.0), size=SMALL)


@pytest.mark.parametrize("per", ["vertex", "triangle", "corner", "point"])
def test_the_part_takes_the_colours_of_its_values(per: str) -> None:
    part = cube()
    # Thickness 2 on the left half of what is seen, 6 on the right; from the top.
    value = {
        "vertex": np.where(part.vertices[:, 0] < 0.5, 2.0, 6.0),
        "triangle": np.full(12, 4.0),
        "corner": np.where(part.corners[:, :, 0] < 0.5, 2.0, 6.0),
        "point": np.zeros(0),
    }[per]
    at = None
    if per == "point":
        x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 60)))
        at = tf.PointCloud(np.stack([x, y, np.ones_like(x)], axis=1), np.tile([0.0, 0.0, 1.0], (3600, 1)))
        value = 2.0 + 4.0 * x
    image = pictures.thickness_picture(part, value, at=at, span=(2.0, 6.0), view="top", size=(800, 600), title="")
    seen = pixels(image)
    lab = colours.to_oklab(seen)
    chroma = np.hypot(lab[..., 1], lab[..., 2])
    # The part is the widest coloured thing, the bar the other.
    row = chroma[330] > 0.05
    starts = np.flatnonzero(np.diff(np.concatenate([[0], row.astype(int), [0]])))
    spans = sorted(zip(starts[::2], starts[1::2], strict=True), key=lambda pair: pair[0] - pair[1])
    left, right = (int(end) for end in spans[0])
    assert right - left > 250
    light = lab[330, left + 10 : right - 10, 0]
    hue = np.unwrap(np.arctan2(lab[330, left + 10 : right - 10, 2], lab[330, left + 10 : right - 10, 1]))
    if per == "triangle":
        assert np.ptp(light) < 0.03
    else:
        assert light[-1] - light[0] > 0.4
        assert (np.diff(light[::20]) > 0).all()
        # From violet to yellow as on the bar.
        assert hue[0] - hue[-1] == pytest.approx(math.radians(190), abs=0.35)


def test_unknown_thickness_is_grey() -> None:
    image = pictures.thickness_picture(cube(), [math.nan] * 12, span=(0.0, 1.0), view="top", size=(800, 600))
    red, green, blue = pixels(image)[330, 300]
    assert red == green == blue < 250


def test_grey_is_explained_where_it_is_drawn() -> None:
    def key(values: list[float]) -> int:
        image = pictures.thickness_picture(cube(), values, span=(0.0, 1.0), view="top", size=(800, 600))
        # Right of the part, under the colour bar.
        return int((np.asarray(pixels(image)[:, 600:]) == lettering.UNKNOWN).all(axis=2).sum())

    assert key([math.nan] * 12) > 100
    assert key([0.5] * 12) == 0
    assert key([0.5] * 11 + [math.nan]) > 100


def test_values_of_as_many_vertices_as_triangles_belong_to_the_vertices() -> None:
    part = tf.TriangleMesh([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]])
    assert pictures._values(part, [1.0, 2.0, 3.0, 4.0])[1] == "vertex"


def test_a_part_is_named_over_its_pictures() -> None:
    part, long = cube(), tf.TriangleMesh(cube().vertices, cube().triangles, "a name as long as a shelf " * 6)
    named = pixels(pictures.thickness_picture(part, np.arange(8.0), size=(800, 600)))
    bare = pixels(pictures.thickness_picture(part, np.arange(8.0), title="", size=(800, 600)))
    assert (named[:60] < 128).sum() > 200 > (bare[:60] < 128).sum()
    # Long ones are written smaller, not cut off.
    for image in (
        pictures.thickness_picture(long, np.arange(8.0), size=(800, 600)),
        pictures.heavy_sections_picture(long, [], size=(800, 600)),
    ):
        assert (pixels(image)[:60, -20:] == 255).all()


def test_a_note_stands_at_the_foot_and_letters_may_be_larger() -> None:
    def foot(image: Image.Image) -> int:
        return int((pixels(image)[-60:, :300] < 200).sum())

    part, balls = cube(), [((0.5, 0.5, 0.5), 0.2)]

    def walls(note: str, text: float | None) -> Image.Image:
        return pictures.thickness_picture(part, np.arange(8.0), size=(800, 600), note=note, text=text)

    def heavy(note: str, text: float | None) -> Image.Image:
        return pictures.heavy_sections_picture(part, balls, size=(800, 600), note=note, text=text)

    for draw in (walls, heavy):
        assert foot(draw("a note", 26.0)) > 2 * foot(draw("a note", None)) > 2 * foot(draw("", None)) == 0


@pytest.mark.parametrize("aspect", [0.05, 0.4, 1.0, 1.3, 2.5, 8.0])
@pytest.mark.parametrize("size", [(1600, 1200), (1200, 1600), (3000, 600)])
def test_panels_fill_the_page_and_keep_apart(aspect: float, size: tuple[int, int]) -> None:
    room = (50, 120, size[0] - 50, size[1] - 50)
    one = layout.single(room, aspect, 250, 30)
    two = layout.double(room, aspect, 250, 30, 70)
    for plan in (one, two):
        boxes = [box for box in plan if box is not None]
        for left, top, right, bottom in boxes:
            assert room[0] <= left < right <= room[2]
            assert room[1] <= top < bottom <= room[3]
        for index, a in enumerate(boxes):
            for b in boxes[:index]:
                assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
        wide, high = plan.part[2] - plan.part[0], plan.part[3] - plan.part[1]
        assert abs(wide - high * aspect) <= max(1.0, aspect)
        # As large as a side of the room allows beside the column of colours.
        assert wide >= 0.5 * (room[2] - room[0] - 280) or high >= 0.5 * (room[3] - room[1])
    assert one.second is None
    assert two.second is not None


def test_the_ball_of_the_thickest_place_is_drawn_and_named(tmp_path: Path) -> None:
    part = cube()
    plain = pictures.thickness_picture(part, np.arange(8.0), size=(800, 600))
    image = pictures.thickness_picture(
        part, np.arange(8.0), tmp_path / "t.png", above=5.0, below=1.5, ball=((0.5, 0.5, 0.5), 0.5), size=(800, 600)
    )
    red, _, blue = np.moveaxis(pixels(image), 2, 0)
    ball = (red - blue > 45) & (red > 120)
    assert ball.sum() > 2000
    assert ball.sum() > 4 * ((pixels(plain)[..., 0] - pixels(plain)[..., 2] > 45) & (pixels(plain)[..., 0] > 230)).sum()


def test_heavy_sections_are_numbered_in_their_colours() -> None:
    balls = [((0.25, 0.5, 0.5), 0.2), ((0.75, 0.5, 0.5), 0.15)]
    image = pictures.heavy_sections_picture(
        cube(), balls, contour=ball_cloud(500), above=0.25, view="front", size=(800, 600)
    )
    seen = pixels(image)
    for red, green, blue in colours.distinct(2):
        near = (np.abs(seen - [red, green, blue]).max(axis=2) < 12).sum()
        assert near > 40, (red, green, blue)
    assert pictures.heavy_sections_picture(cube(), [], above=9.0, size=SMALL).size == SMALL
    many = [((0.5, 0.5, 0.5), 0.01 * (k + 1)) for k in range(60)]
    assert pictures.heavy_sections_picture(cube(), many, size=SMALL).size == SMALL


def test_the_histogram_shows_the_shares(tmp_path: Path) -> None:
    # A quarter of the weight at 2, the rest at 8; the map says which bar is which.
    values, weights = [2.0, 8.0, math.nan], [1.0, 3.0, 100.0]
    path = tmp_path / "h.png"
    image = pictures.histogram_picture(
        values, weights, path, span=(0.0, 10.0), bins=10, percentiles=(), size=(800, 500)
    )
    seen = pixels(image)
    heights = []
    for value in (2.5, 8.5):
        colour = colours.colours_of(value, 0.0, 10.0).astype(int)
        bar = (np.abs(seen - colour).max(axis=2) == 0).any(axis=1)
        heights.append(int(bar.sum()))
    assert heights[1] == pytest.approx(3 * heights[0], abs=3)
    assert heights[0] > 50


def test_marks_of_the_histogram_stay_inside() -> None:
    rng = np.random.default_rng(0)
    for values in (rng.gamma(2.0, 1.0, 500), np.full(50, 3.0), [1e-9, 2e-9], [1e9, 3e9], [0.0]):
        image = pictures.histogram_picture(
            values,
            above=float(np.max(values)),
            below=float(np.min(values)),
            percentiles=(1, 5, 50, 95, 99),
            size=(640, 400),
        )
        border = np.concatenate([pixels(image)[0], pixels(image)[-1], pixels(image)[:, 0], pixels(image)[:, -1]])
        assert (border == 255).all()


def test_pictures_do_not_depend_on_the_threads() -> None:
    part, cloud = cube(), ball_cloud(1000)
    one, two, seven = (pixels(pictures.contour_picture(part, cloud, size=SMALL, threads=n)) for n in (1, 2, 7))
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(one, seven)


def test_progress_is_told_and_can_stop_the_picture() -> None:
    def stop(phase: str, fraction: float) -> None:
        raise RuntimeError(f"{phase} {fraction}")

    cloud = ball_cloud(200_000)
    with pytest.raises(RuntimeError, match="picture"):
        pictures.contour_picture(cube(), cloud, size=(6000, 6000), radius=0.05, progress=stop)


# Bad input ----------------------------------------------------------------------------------------------------------

Call = Callable[[], Any]
NOWHERE = tf.PointCloud([[0.0, 0.0, 0.0], [0.0, math.nan, 0.0]])
BARE = tf.PointCloud([[0, 0, 0]])
STRANGE = tf.PointCloud([[0, 0, 0]], triangle=[12])
BAD: list[tuple[str, Call]] = [
    ("size", lambda: pictures.part_picture(cube(), size=(0, 100))),
    ("size", lambda: pictures.part_picture(cube(), size=(100, -1))),
    ("size", lambda: pictures.part_picture(cube(), size=(10**6, 100))),
    ("size", lambda: pictures.histogram_picture([1.0], size=(0, 0))),
    ("no view called", lambda: pictures.part_picture(cube(), view="upside down", size=SMALL)),
    ("view", lambda: pictures.part_picture(cube(), view=(1.0, 2.0), size=SMALL)),  # type: ignore[arg-type]
    ("view", lambda: pictures.part_picture(cube(), view=(math.nan, 0.0, 1.0), size=SMALL)),
    ("parallel", lambda: pictures.part_picture(cube(), view=((0.0, 0.0, 1.0), (0.0, 0.0, 1.0)), size=SMALL)),
    ("point 1", lambda: pictures.contour_picture(cube(), NOWHERE, size=SMALL, radius=0.1)),
    ("radius", lambda: pictures.contour_picture(cube(), ball_cloud(), size=SMALL, radius=-1.0)),
    ("one per vertex", lambda: pictures.thickness_picture(cube(), [1.0, 2.0], size=SMALL)),
    ("none of the values", lambda: pictures.thickness_picture(cube(), [math.nan] * 8, size=SMALL)),
    ("span", lambda: pictures.thickness_picture(cube(), [1.0] * 8, span=(2.0, 1.0), size=SMALL)),
    ("positive radius", lambda: pictures.thickness_picture(cube(), [1.0] * 8, ball=((0, 0, 0), 0.0), size=SMALL)),
    ("positive radius", lambda: pictures.heavy_sections_picture(cube(), [((0, math.inf, 0), 1.0)], size=SMALL)),
    ("neither triangles nor normals", lambda: pictures.thickness_picture(cube(), [1.0], at=BARE, size=SMALL)),
    ("triangle that the mesh has not", lambda: pictures.thickness_picture(cube(), [1.0], at=STRANGE, size=SMALL)),
    ("each of the 1 points", lambda: pictures.thickness_picture(cube(), [1.0] * 2, at=BARE, size=SMALL)),
    ("as many weights", lambda: pictures.histogram_picture([1.0], [1.0, 2.0])),
    ("weight", lambda: pictures.histogram_picture([1.0], [-1.0])),
    ("weight", lambda: pictures.histogram_picture([])),
    ("bars", lambda: pictures.histogram_picture([1.0], bins=0)),
]  # fmt: skip


@pytest.mark.parametrize(("says", "call"), BAD)
def test_what_cannot_be_drawn_is_refused_in_a_sentence(says: str, call: Call) -> None:
    with pytest.raises(tf.TruefieldError, match=says) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_an_unwritable_path_leaves_nothing_behind(tmp_path: Path) -> None:
    with pytest.raises(tf.FileError):
        pictures.part_picture(cube(), tmp_path / "missing" / "part.png", size=SMALL)
    assert not list(tmp_path.iterdir())


# The native classes -------------------------------------------------------------------------------------------------


def test_a_ball_has_the_depth_and_outline_of_geometry() -> None:
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], dtype=np.float64) * 2 - 1
    camera = Camera(corners, "front", margin=0.0)
    scene = Scene()
    scene.add_balls(np.zeros((1, 3)), np.array([0.8]), np.array([[200, 60, 60]], dtype=np.uint8))
    rgba, depth = scene.render(camera, 200, 200, samples=25)
    assert rgba.shape == (200, 200, 4)
    assert rgba.dtype == np.uint8
    assert depth.dtype == np.float32
    covered = (rgba[..., 3] / 255.0).sum() * 0.01**2
    assert covered == pytest.approx(math.pi * 0.8**2, rel=0.002)
    x = (np.arange(200) + 0.5) / 100 - 1
    square = 0.8**2 - x[None, :] ** 2 - x[:, None] ** 2
    away = float(np.linalg.norm(camera.eye))
    expected = np.where(square > 0, away - np.sqrt(np.maximum(square, 0)), np.inf)
    np.testing.assert_allclose(depth, expected, atol=1e-5)
    assert Scene().extent is None
    assert scene.extent is not None
    np.testing.assert_allclose(scene.extent, [[-0.8] * 3, [0.8] * 3])


def test_projection_agrees_with_the_picture() -> None:
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], dtype=np.float64)
    for view_angle in (None, 35.0):
        camera = Camera(corners, "isometric", field_of_view=view_angle, margin=0.1)
        spot = np.array([[0.3, 0.6, 0.8]])
        scene = Scene()
        scene.add_balls(spot, np.array([0.03]), np.array([[0, 0, 0]], dtype=np.uint8))
        rgba, _ = scene.render(camera, 300, 200, samples=25)
        weight = rgba[..., 3].astype(float)
        y, x = np.mgrid[:200, :300] + 0.5
        seen = np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()
        np.testing.assert_allclose(camera.project(spot, 300, 200)[0, :2], seen, atol=0.1)


@pytest.mark.parametrize(("width", "height", "samples"), [(0, 10, 9), (10, 0, 9), (99999, 10, 9), (10, 10, 4)])
def test_the_renderer_refuses_odd_sizes(width: int, height: int, samples: int) -> None:
    with pytest.raises(tf.TruefieldError):
        Scene().render(Camera(np.eye(3), "top"), width, height, samples=samples)
