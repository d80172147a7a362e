"""Pictures of parts, contours and thickness, rendered without a display. Each is returned and, given a path, written.

All functions take `size` in pixels (width, height), `threads` (None: all) and a `view`: "isometric", "front", "back",
"left", "right", "top", "bottom", a direction to look along, or a pair of direction and up vector.
The same input gives the same pixels for any number of threads.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw

from truefield._truefield import Camera, Scene, field_outline, render_field
from truefield.adaptive import AdaptiveField
from truefield.cloud import PointCloud
from truefield.colours import Colour, colours_of, distinct, even_map
from truefield.errors import TruefieldError
from truefield.files import PathLike, replacing
from truefield.layout import double, single
from truefield.lettering import (
    FAINT,
    INK,
    LIMIT,
    RULE,
    Box,
    badge,
    colour_bar,
    grey_key,
    number,
    tick_labels,
    ticks,
    wedge,
    width_of,
    write,
)
from truefield.mesh import TriangleMesh

Array = NDArray[np.float64]
Vector = tuple[float, float, float]
View = str | Vector | tuple[Vector, Vector]
Ball = tuple[ArrayLike, float]
Progress = Callable[[str, float], None]
_How = tuple[int | None, Progress | None]

WHITE: Final[Colour] = (255, 255, 255)
_GLASS: Final[Colour] = (138, 172, 205)
_METAL: Final[Colour] = (196, 204, 212)
_WARM: Final[Colour] = (233, 106, 38)
_LINES: Final[Colour] = (24, 36, 50)
_CLEARNESS: Final = 0.11
_OCCLUSION: Final = 0.7
_LEAST, _MOST = 64, 16384


def contour_picture(
    mesh: TriangleMesh,
    cloud: PointCloud,
    path: PathLike | None = None,
    *,
    view: View = "isometric",
    size: tuple[int, int] = (1600, 1200),
    radius: float | None = None,
    colour: Colour = _WARM,
    background: Colour | None = WHITE,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Image.Image:
    """The part as glass and a contour inside it as shaded discs, one per point.

    Args:
        mesh: the part.
        cloud: the contour, with normals.
        path: PNG to write, or None.
        view: from where; see the module.
        size: width and height in pixels.
        radius: of the discs in model units; None takes it from the distances of neighbouring points.
        colour: of the contour.
        background: a colour, or None for a transparent picture.
        threads: worker threads.
        progress: told the phase and the fraction done.

    Raises:
        TruefieldError: an input cannot be drawn; the sentence says why.
    """
    _check_size(size)
    scene = Scene()
    _add_part(scene, mesh, size, opacity=_CLEARNESS)
    _add_points(scene, cloud, radius, colour)
    # A contour outside the part must fit into the picture too; some of its points say how far it reaches.
    reach = cloud.points[:: max(1, len(cloud) // 100_000)]
    image = _render(scene, _camera(mesh, view, reach), size, background, (threads, progress))
    return _finished(image, path)


def part_picture(
    mesh: TriangleMesh,
    path: PathLike | None = None,
    *,
    view: View = "isometric",
    size: tuple[int, int] = (1600, 1200),
    colour: Colour = _METAL,
    background: Colour | None = WHITE,
    edges: bool = True,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Image.Image:
    """The part, opaque; with lines along its sharp edges, unless `edges` is False, as where these follow cells.

    Raises:
        TruefieldError: an input cannot be drawn; the sentence says why.
    """
    _check_size(size)
    scene = Scene()
    _add_part(scene, mesh, size, colour=colour, edges=edges)
    return _finished(_render(scene, _camera(mesh, view), size, background, (threads, progress)), path)


def field_picture(
    field: AdaptiveField,
    path: PathLike | None = None,
    *,
    distance: float = 0.0,
    view: View = "isometric",
    size: tuple[int, int] = (1600, 1200),
    samples: int = 9,
    colour: Colour = _METAL,
    background: Colour | None = WHITE,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Image.Image:
    """The surface of an adaptive field by rays, without a mesh between.

    Args:
        field: what to draw.
        path: PNG to write, or None.
        distance: of the surface, model units: 0 the shape itself, more of it grown, less of it shrunk.
        view: from where; see the module.
        size: width and height in pixels.
        samples: rays a pixel: 1, 9 or 25.
        colour: of the surface.
        background: a colour, or None for a transparent picture.
        threads: worker threads.
        progress: told the phase and the fraction done.

    Raises:
        TruefieldError: an input cannot be drawn; the sentence says why.
    """
    _check_size(size)
    outline = field_outline(field._native, distance, threads, progress)
    if len(outline) == 0:
        raise TruefieldError(f"no surface is at distance {distance:g}; there is nothing to draw")
    camera = _view(outline, view, 0.06)
    pixels, _ = render_field(
        field._native,
        camera,
        size[0],
        size[1],
        colour,
        distance,
        samples=samples,
        background=background,
        occlusion=_OCCLUSION,
        threads=threads,
        progress=progress,
    )
    image = Image.fromarray(pixels)
    return _finished(image if background is None else image.convert("RGB"), path)


def thickness_picture(
    mesh: TriangleMesh,
    values: ArrayLike,
    path: PathLike | None = None,
    *,
    at: PointCloud | None = None,
    above: float | None = None,
    below: float | None = None,
    ball: Ball | None = None,
    span: tuple[float, float] | None = None,
    title: str | None = None,
    note: str = "",
    view: View = "isometric",
    size: tuple[int, int] = (1600, 1200),
    text: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Image.Image:
    """The part coloured by thickness, a colour bar with the limits, and the part as glass with its thickest place.

    Args:
        mesh: the part.
        values: thickness in model units: (n,) per vertex, (m,) per triangle or (m, 3) per corner, or, with `at`, one
            for each of its points. Where a mesh has as many vertices as triangles, (n,) is per vertex. NaN is drawn
            grey; with `at` it is left out.
        path: PNG to write, or None.
        at: points of the surface where the values are known, with triangles or normals; each pixel takes the mean of
            those around it that face its way, and is grey where none is near.
        above: limit marked on the bar.
        below: limit marked on the bar.
        ball: centre (3,) and radius of the largest inscribed ball; None leaves the second panel out.
        span: values at the ends of the bar; None takes those of the data.
        title: over the picture; None names the part.
        note: a line at the foot of the picture.
        view: from where; see the module.
        size: width and height in pixels.
        text: height of the letters in pixels; None takes what suits the size.
        threads: worker threads.
        progress: told the phase and the fraction done.

    Raises:
        TruefieldError: an input cannot be drawn; the sentence says why.
    """
    _check_size(size)
    data, per = _values(mesh, values) if at is None else (_values_at(at, values), "point")
    span = _span(data, span)
    camera = _camera(mesh, view, margin=0.0)
    unit = min(size[0] / 1600, size[1] / 1200)
    text = 26.0 * unit if text is None else text
    page = Image.new("RGB", size, WHITE)
    draw = ImageDraw.Draw(page)
    edge = round(48 * unit)
    _head(page, f"Wall thickness of {mesh.name}" if title is None else title, "model units", edge, text)

    limits = [(name, value) for name, value in (("above", above), ("below", below)) if value is not None]
    grey = "not measured" if np.isnan(data).any() else ""
    words = () if ball is None else ("Thickest place:", f"a ball of diameter {number(2.0 * _ball(ball)[1])} fits in")
    names = max([width_of(f"{name} {number(value)}", text) + 1.2 * text for name, value in limits], default=0.0)
    labels = max(width_of(label, text) for label in tick_labels(ticks(*span))) + 0.8 * text
    bar = round(34 * unit)
    told = width_of(grey, text) + bar + 0.5 * text if grey else 0.0
    after = max(labels, told - bar)
    key = round(max([names + bar + after, *(width_of(line, text) for line in words)]))
    foot = round(1.6 * text) if note else 0
    write(draw, (edge, size[1] - edge), note, 0.8 * text, colour=FAINT, anchor="ls")
    room = (edge, edge + round(3.4 * text), size[0] - edge, size[1] - edge - foot)
    aspect, gap = _aspect(camera), round(1.3 * text)
    plan = single(room, aspect, key, gap) if ball is None else double(room, aspect, key, gap, round(2.7 * text))
    # Names, bar and labels together in the middle of their column.
    left, top, right, bottom = plan.key
    left += round(0.5 * (right - left - names - bar - after) + names)
    bottom -= round(2.1 * text) if grey else 0
    colour_bar(page, (left, top, left + bar, bottom), span, text, limits)
    if grey:
        grey_key(page, (left, round(bottom + 0.8 * text)), bar, grey, text)

    scene = Scene()
    ramp, ink = np.ascontiguousarray(even_map()), (_LINES, 0.6, _pen(size))
    if at is None:
        scene.add_mesh(mesh.vertices, mesh.triangles, ramp, per, data.ravel(), span, finish="chart", ink=ink)
    else:
        normals = _normals_at(mesh, at)
        scene.add_sampled_mesh(mesh.vertices, mesh.triangles, at.points, normals, data, ramp, span, ink=ink)
    _place(page, scene, camera, plan.part, (threads, progress))
    if ball is not None and plan.second is not None:
        center, radius = _ball(ball)
        box = plan.second
        glass = Scene()
        _add_part(glass, mesh, size, opacity=_CLEARNESS)
        glass.add_balls(center[None, :], np.array([radius]), np.array([_WARM], dtype=np.uint8))
        _place(page, glass, camera, box, (threads, progress))
        half = 0.5 * max(width_of(line, text) for line in words)
        middle = min(max(0.5 * (box[0] + box[2]), edge + half), size[0] - edge - half)
        for index, line in enumerate(words):
            write(draw, (middle, box[3] + (1.3 + 1.3 * index) * text), line, text, anchor="ms")
    return _finished(page, path)


def heavy_sections_picture(
    mesh: TriangleMesh,
    balls: Sequence[Ball],
    path: PathLike | None = None,
    *,
    contour: PointCloud | None = None,
    above: float | None = None,
    note: str = "",
    view: View = "isometric",
    size: tuple[int, int] = (1600, 1200),
    text: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Image.Image:
    """The part as glass with the deepest ball of each heavy section, numbered and listed.

    Args:
        mesh: the part.
        balls: centre (3,) and radius of each section's deepest ball, in the order of their numbers, 1 first.
        path: PNG to write, or None.
        contour: drawn inside, for instance where depth equals half the limit.
        above: the limit on wall thickness, for the title.
        note: a line at the foot of the picture.
        view: from where; see the module.
        size: width and height in pixels.
        text: height of the letters in pixels; None takes what suits the size.
        threads: worker threads.
        progress: told the phase and the fraction done.

    Raises:
        TruefieldError: an input cannot be drawn; the sentence says why.
    """
    _check_size(size)
    pairs = [_ball(ball) for ball in balls]
    unit = min(size[0] / 1600, size[1] / 1200)
    text = 26.0 * unit if text is None else text
    edge = round(48 * unit)
    page = Image.new("RGB", size, WHITE)
    draw = ImageDraw.Draw(page)
    count = len(pairs)
    title = "No heavy section" if count == 0 else "1 heavy section" if count == 1 else f"{count} heavy sections"
    limit = "" if above is None else f"thicker than {number(above)}; "
    _head(page, f"{title} in {mesh.name}", f"{limit}diameters of the balls that fit in, model units", edge, text)
    camera = _camera(mesh, view, margin=0.03)
    scene = Scene()
    _add_part(scene, mesh, size, opacity=_CLEARNESS)
    if contour is not None:
        _add_points(scene, contour, None, _WARM)
    palette = distinct(count)
    for (center, radius), colour in zip(pairs, palette, strict=True):
        scene.add_balls(center[None, :], np.array([radius]), np.array([colour], dtype=np.uint8))
    top, bottom = edge + round(3.6 * text), size[1] - edge - (round(1.6 * text) if note else 0)
    write(draw, (edge, size[1] - edge), note, 0.8 * text, colour=FAINT, anchor="ls")
    shown = min(count, max(1, int((bottom - top) / (1.75 * text)) - 1))
    rows = [number(2.0 * radius) for _, radius in pairs[:shown]]
    column = round(max([width_of(row, text) for row in rows], default=0.0) + 2.4 * text) + edge if rows else edge
    box = (edge, top, size[0] - column - edge // 2, bottom)
    _place(page, scene, camera, box, (threads, progress))
    left = size[0] - column
    for index, row in enumerate(rows):
        y = top + 1.75 * text * (index + 0.5)
        badge(page, (left + 0.6 * text, y), str(index + 1), text, palette[index])
        write(draw, (left + 1.8 * text, y), row, text, anchor="lm")
    if shown < count:
        y = top + 1.75 * text * (shown + 0.5)
        write(draw, (left + 1.8 * text, y), f"and {count - shown} more", text, colour=FAINT, anchor="lm")
    if pairs:
        wide, high = box[2] - box[0], box[3] - box[1]
        pixels = camera.project(np.array([center for center, _ in pairs]), wide, high)
        for index, (x, y, _) in enumerate(pixels[:shown].tolist()):
            badge(page, (box[0] + x, box[1] + y), str(index + 1), text, palette[index])
    return _finished(page, path)


def histogram_picture(
    values: ArrayLike,
    weights: ArrayLike | None = None,
    path: PathLike | None = None,
    *,
    above: float | None = None,
    below: float | None = None,
    percentiles: Sequence[float] = (5.0, 50.0, 95.0),
    span: tuple[float, float] | None = None,
    title: str = "Wall thickness",
    share: str = "share of area",
    bins: int = 64,
    size: tuple[int, int] = (1600, 1000),
) -> Image.Image:
    """A weighted histogram in the colours of the colour bar, with percentiles and limits.

    Args:
        values: (n,) in model units; NaN are left out.
        weights: (n,) areas; None counts all alike.
        path: PNG to write, or None.
        above: limit drawn as a line.
        below: limit drawn as a line.
        percentiles: marked under the axis; area-weighted.
        span: ends of the axis and of the colour map; None takes those of the data.
        title: over the picture.
        share: what the upright axis counts.
        bins: number of bars.
        size: width and height in pixels.

    Raises:
        TruefieldError: an input cannot be drawn; the sentence says why.
    """
    _check_size(size)
    data, weight = _weighted(values, weights)
    if not 1 <= bins <= 4096:
        raise TruefieldError(f"a histogram needs 1 to 4096 bars, not {bins}")
    span = _span(data, span)
    heights, edges = np.histogram(np.clip(data, *span), bins=bins, range=span, weights=weight / weight.sum())
    heights = 100.0 * heights
    unit = min(size[0] / 1600, size[1] / 1000)
    text = 26.0 * unit
    edge = round(48 * unit)
    page = Image.new("RGB", size, WHITE)
    draw = ImageDraw.Draw(page)
    _head(page, title, f"{share} per bar", edge, text)

    most = float(heights.max()) * 1.08
    uprights = ticks(0.0, most, most=6)
    labels = [f"{label} %" for label in tick_labels(uprights)]
    left = edge + round(max(width_of(label, text) for label in labels) + 0.8 * text)
    right, top = size[0] - edge, edge + round(5.2 * text)
    bottom = size[1] - edge - round(5.0 * text)

    def x_of(value: float) -> float:
        return left + (value - span[0]) / (span[1] - span[0]) * (right - left)

    def y_of(height: float) -> float:
        return bottom - height / most * (bottom - top)

    thin = max(1, round(1.5 * unit))
    for place, label in zip(uprights, labels, strict=True):
        y = round(y_of(place))
        draw.line((left, y, right, y), fill=RULE, width=thin)
        write(draw, (left - 0.5 * text, y), label, text, anchor="rm")
    bar_colours = colours_of(0.5 * (edges[1:] + edges[:-1]), *span)
    for index, height in enumerate(heights.tolist()):
        x0, x1 = round(x_of(float(edges[index]))), round(x_of(float(edges[index + 1])))
        y = round(y_of(height))
        if height > 0.0:
            gap = 1 if x1 - x0 > 5 else 0
            red, green, blue = bar_colours[index].tolist()
            draw.rectangle((x0, min(y, bottom - 1), x1 - 1 - gap, bottom - 1), fill=(red, green, blue))
    draw.line((left, bottom, right, bottom), fill=INK, width=max(1, round(2 * unit)))
    places = ticks(*span, most=max(2, min(11, int((right - left) / (4.5 * text)))))
    for place, label in zip(places, tick_labels(places), strict=True):
        x = round(x_of(place))
        draw.line((x, bottom, x, bottom + 0.35 * text), fill=INK, width=thin)
        write(draw, (x, bottom + 0.6 * text), label, text, anchor="ma")
    write(draw, (right, bottom + 3.6 * text), "model units", text, colour=FAINT, anchor="ra")
    _percentiles(page, data, weight, percentiles, x_of=x_of, y=bottom + 2.1 * text, text=text)
    for name, value, row in (("below", below, 0.6), ("above", above, 1.8)):
        if value is not None and span[0] <= value <= span[1]:
            beyond = float(weight[data < value].sum() if name == "below" else weight[data > value].sum())
            words = f"{number(100.0 * beyond / float(weight.sum()))} % {name} {number(value)}"
            x, base = round(x_of(value)), top - row * text
            draw.line((x, base - 0.8 * text, x, bottom), fill=LIMIT, width=max(1, round(2.5 * unit)))
            # On the side that it speaks of, where there is room.
            room = right - x if name == "above" else x - left
            rightward = (name == "above") == (room > width_of(words, text) + text)
            write(
                draw,
                (x + (0.4 if rightward else -0.4) * text, base),
                words,
                text,
                colour=LIMIT,
                anchor="ls" if rightward else "rs",
            )
    return _finished(page, path)


def _percentiles(
    page: Image.Image,
    data: Array,
    weight: Array,
    percentiles: Sequence[float],
    *,
    x_of: Callable[[float], float],
    y: float,
    text: float,
) -> None:
    order = np.argsort(data, kind="stable")
    below = np.cumsum(weight[order])
    end = 0.0
    for percentile in sorted(percentiles):
        place = int(np.searchsorted(below, percentile / 100.0 * below[-1]))
        value = float(data[order[min(place, len(order) - 1)]])
        words = f"median {number(value)}" if percentile == 50.0 else f"{number(percentile)} %: {number(value)}"
        half = 0.5 * width_of(words, text)
        # Labels that would touch the one before move right.
        middle = min(max(x_of(value), half + 0.5 * text, end + half), page.width - half - 0.5 * text)
        end = middle + half + 0.8 * text
        wedge(page, (x_of(value), y), 0.6 * text, -90.0, INK)
        write(ImageDraw.Draw(page), (middle, y + 0.9 * text), words, text, anchor="ma")


def _check_size(size: tuple[int, int]) -> None:
    if len(size) != 2 or not all(isinstance(side, int) and _LEAST <= side <= _MOST for side in size):
        raise TruefieldError(
            f"a picture of size {size} cannot be drawn; give (width, height), both {_LEAST} to {_MOST}"
        )


def _camera(mesh: TriangleMesh, view: View, more: Array | None = None, *, margin: float = 0.06) -> Camera:
    points = mesh.vertices[np.unique(mesh.triangles)]
    if more is not None:
        points = np.concatenate([points, more])
    return _view(points, view, margin)


def _view(points: Array, view: View, margin: float) -> Camera:
    if isinstance(view, str):
        return Camera(points, view, margin=margin)
    try:
        given = np.asarray(view, dtype=np.float64)
    except (TypeError, ValueError):
        given = np.empty(0)
    if given.shape not in ((3,), (2, 3)) or not np.isfinite(given).all():
        raise TruefieldError(
            f"the view {view!r} is neither a name nor a direction nor a pair of direction and up vector"
        )
    direction, up = (given, np.array([0.0, 0.0, 1.0])) if given.ndim == 1 else given
    if given.ndim == 1 and np.linalg.norm(np.cross(direction, up)) < 1e-3 * np.linalg.norm(direction):
        up = np.array([0.0, 1.0, 0.0])
    return Camera(points, direction=tuple(direction.tolist()), up=tuple(up.tolist()), margin=margin)


def _head(page: Image.Image, title: str, subtitle: str, edge: int, text: float) -> None:
    """Title and subtitle at the top left; what is too long for the page is written smaller."""
    draw, wide = ImageDraw.Draw(page), width_of(title, 1.5 * text)
    room = page.width - 2 * edge
    write(draw, (edge, edge), title, 1.5 * text * min(1.0, room / max(wide, 1.0)))
    small = text * min(1.0, room / max(width_of(subtitle, text), 1.0))
    write(draw, (edge, edge + 2.0 * text), subtitle, small, colour=FAINT)


def _pen(size: tuple[int, int]) -> float:
    """Width of lines in pixels: the same share of any picture."""
    return max(1.0, 1.5 * min(size[0] / 1600, size[1] / 1200))


def _add_part(
    scene: Scene,
    mesh: TriangleMesh,
    size: tuple[int, int],
    *,
    opacity: float = 1.0,
    colour: Colour | None = None,
    edges: bool = True,
) -> None:
    solid = opacity >= 1.0
    scene.add_mesh(
        mesh.vertices,
        mesh.triangles,
        np.array([colour or (_METAL if solid else _GLASS)], dtype=np.uint8),
        finish="satin" if solid else "polished",
        opacity=opacity,
        ink=(_LINES, 0.7 if solid else 0.5, _pen(size)) if edges else None,
    )


def _add_points(scene: Scene, cloud: PointCloud, radius: float | None, colour: Colour) -> None:
    if len(cloud) == 0:
        return
    # Without normals the discs face the viewer.
    normals = np.zeros_like(cloud.points) if cloud.normals is None else cloud.normals
    scene.add_points(cloud.points, normals, np.array([colour], dtype=np.uint8), radius=radius)


def _render(scene: Scene, camera: Camera, size: tuple[int, int], background: Colour | None, how: _How) -> Image.Image:
    threads, progress = how
    pixels, _ = scene.render(
        camera,
        size[0],
        size[1],
        background=background,
        occlusion=_OCCLUSION,
        threads=threads,
        progress=progress,
    )
    image = Image.fromarray(pixels)
    return image if background is None else image.convert("RGB")


def _place(page: Image.Image, scene: Scene, camera: Camera, box: Box, how: _How) -> None:
    size = (max(box[2] - box[0], 1), max(box[3] - box[1], 1))
    page.paste(_render(scene, camera, size, WHITE, how), (box[0], box[1]))


def _aspect(camera: Camera) -> float:
    """Width over height of what the camera holds."""
    wide, high = camera.span
    return wide / high


def _ball(ball: Ball) -> tuple[Array, float]:
    center, radius = np.asarray(ball[0], dtype=np.float64), float(ball[1])
    if center.shape != (3,) or not np.isfinite(center).all() or not (radius > 0.0 and math.isfinite(radius)):
        raise TruefieldError(f"the ball {ball!r} is no centre (x, y, z) with a positive radius")
    return center, radius


def _values(mesh: TriangleMesh, values: ArrayLike) -> tuple[Array, str]:
    data = np.ascontiguousarray(values, dtype=np.float64)
    vertices, triangles = len(mesh.vertices), len(mesh.triangles)
    for shape, per in (((vertices,), "vertex"), ((triangles,), "element"), ((triangles, 3), "corner")):
        if data.shape == shape:
            return data, per
    raise TruefieldError(
        f"the values have shape {data.shape}; give one per vertex ({vertices},), per triangle ({triangles},) "
        f"or per corner ({triangles}, 3)"
    )


def _values_at(cloud: PointCloud, values: ArrayLike) -> Array:
    data = np.ascontiguousarray(values, dtype=np.float64)
    if data.shape != (len(cloud),):
        raise TruefieldError(f"the values have shape {data.shape}; give one for each of the {len(cloud)} points")
    return data


def _normals_at(mesh: TriangleMesh, cloud: PointCloud) -> Array:
    if cloud.triangle is None:
        if cloud.normals is None:
            raise TruefieldError("the points have neither triangles nor normals; give them one of the two")
        return cloud.normals
    if len(cloud) and not 0 <= cloud.triangle.min() <= cloud.triangle.max() < len(mesh.triangles):
        raise TruefieldError(f"a point names a triangle that the mesh has not (0 to {len(mesh.triangles) - 1})")
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles[cloud.triangle]], 1, 0)
    return np.cross(b - a, c - a)


def _span(data: Array, span: tuple[float, float] | None) -> tuple[float, float]:
    known = data[np.isfinite(data)]
    if span is None and known.size == 0:
        raise TruefieldError("none of the values is a finite number; there is nothing to draw")
    low, high = (float(known.min()), float(known.max())) if span is None else (float(span[0]), float(span[1]))
    if not (math.isfinite(low) and math.isfinite(high) and low <= high):
        raise TruefieldError(f"the span {low} to {high} is no range; give finite ends, the lower one first")
    # A plate has one thickness; its bar still needs a height.
    room = max(0.05 * abs(high), 1e-12) if high - low <= 1e-9 * max(abs(low), abs(high)) else 0.0
    return low - room, high + room


def _weighted(values: ArrayLike, weights: ArrayLike | None) -> tuple[Array, Array]:
    data = np.asarray(values, dtype=np.float64).ravel()
    weight = np.ones_like(data) if weights is None else np.asarray(weights, dtype=np.float64).ravel()
    if data.shape != weight.shape:
        raise TruefieldError(f"{len(data)} values need as many weights, not {len(weight)}")
    if not (np.isfinite(weight).all() and (weight >= 0.0).all()):
        raise TruefieldError("a weight is negative or not finite; weights are areas")
    known = np.isfinite(data)
    if not weight[known].sum() > 0.0:
        raise TruefieldError("no value has a weight above zero; there is nothing to draw")
    return data[known], weight[known]


def _finished(image: Image.Image, path: PathLike | None) -> Image.Image:
    if path is not None:
        with replacing(path) as stream:
            image.save(stream, format="PNG", optimize=False)
    return image
