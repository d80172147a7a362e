"""Pictures of distances in a plane: a slice through a field, or an image's transform, with lines of equal distance."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw

from truefield.arguments import Floats
from truefield.colours import from_oklab
from truefield.errors import TruefieldError
from truefield.fields import CompleteField, Surface
from truefield.files import PathLike, replacing
from truefield.lettering import FAINT, INK, Box, colour_bar, number, ticks, width_of, write
from truefield.sampled import SampledField

Field = Surface | CompleteField | SampledField
Axis = Literal["x", "y", "z"]

_LINES: Final = 9
_LINE: Final = np.array([30.0, 36.0, 44.0])
_PAPER: Final = (255, 255, 255)
# OKLab at the surface and far away: cool and deep inside, warm and pale outside.
_INSIDE: Final = ((0.90, -0.045, -0.035), (0.36, -0.015, -0.125))
_OUTSIDE: Final = ((0.975, 0.004, 0.018), (0.80, 0.035, 0.085))


def slice_picture(
    field: Field,
    axis: Axis = "z",
    at: float | None = None,
    path: PathLike | None = None,
    *,
    lines: float | None = None,
    title: str = "",
    size: tuple[int, int] = (1200, 900),
) -> Image.Image:
    """A slice across an axis: blue inside and sand outside, with a line at each round distance, a strong one at zero.

    Args:
        field: a surface, a complete or a sampled field; what lies outside a sampled one stays white.
        axis: the slice is across "x", "y" or "z". Of the other two, the first runs to the right, the second upward.
        at: where along the axis, model units; the middle by default.
        path: PNG to write, or None.
        lines: distance between lines, model units; a round number by default.
        title: over the picture; says where the slice is by default.
        size: width and height in pixels.

    Each pixel is one question to the field, and a line is as wide on the page wherever the distance is a true one: its
    gradient there has length one.

    Raises:
        TruefieldError: an input cannot be drawn.
    """
    if axis not in ("x", "y", "z"):
        raise TruefieldError(f"axis is {axis!r}; choose 'x', 'y' or 'z'")
    across = "xyz".index(axis)
    low, high = _box(field)
    place = float((low + high)[across] / 2) if at is None else float(at)
    flat = [i for i in range(3) if i != across]
    page = _Page(size, title or f"Distance at {axis} = {number(place)}", "model units, negative inside")
    left, top, right, bottom = page.room((high - low)[flat[0]] / (high - low)[flat[1]])
    points = np.empty((bottom - top, right - left, 3))
    steps = (np.arange(right - left) + 0.5) / (right - left), 1.0 - (np.arange(bottom - top) + 0.5) / (bottom - top)
    points[..., across] = place
    points[..., flat[0]] = low[flat[0]] + steps[0] * (high - low)[flat[0]]
    points[..., flat[1]] = (low[flat[1]] + steps[1] * (high - low)[flat[1]])[:, None]
    values = field.distance(points.reshape(-1, 3)).reshape(bottom - top, right - left)
    pixel = float((high - low)[flat[0]]) / (right - left)
    return page.finished(values, pixel, (left, top, right, bottom), lines, path)


def transform_picture(
    distance: ArrayLike,
    path: PathLike | None = None,
    *,
    spacing: float = 1.0,
    lines: float | None = None,
    title: str = "Distance",
    size: tuple[int, int] = (1200, 900),
) -> Image.Image:
    """The distances of an image as `slice_picture` shows them: (x, y), x to the right, y downward.

    Args:
        distance: (x, y) distances, as `distance_transform` gives them.
        path: PNG to write, or None.
        spacing: between samples of the image, the same along both axes, in the units of the distances.
        lines: distance between lines; a round number by default.
        title: over the picture.
        size: width and height in pixels; samples are interpolated where they are fewer.

    Raises:
        TruefieldError: an input cannot be drawn.
    """
    data = np.asarray(distance, dtype=np.float32)
    if data.ndim != 2 or data.size == 0 or not np.isfinite(data).any():
        raise TruefieldError(f"distances of shape {data.shape} are no image; give (x, y) finite numbers")
    page = _Page(size, title, "negative inside" if (data < 0).any() else "")
    left, top, right, bottom = page.room(data.shape[0] / data.shape[1])
    shown = Image.fromarray(np.ascontiguousarray(data.T)).resize((right - left, bottom - top), Image.Resampling.BICUBIC)
    pixel = spacing * data.shape[0] / (right - left)
    return page.finished(np.asarray(shown, dtype=np.float64), pixel, (left, top, right, bottom), lines, path)


class _Page:
    """Title, room for a map, and a bar of its colours."""

    def __init__(self, size: tuple[int, int], title: str, subtitle: str) -> None:
        if min(size) < 64 or max(size) > 16384:
            raise TruefieldError(f"a picture of {size[0]} x {size[1]} pixels; give 64 to 16384 each")
        self.image = Image.new("RGB", size, _PAPER)
        self.text = 32.0 * min(size[0] / 1200, size[1] / 900)
        self.edge = round(1.5 * self.text)
        draw = ImageDraw.Draw(self.image)
        wide = max(width_of(title, 1.5 * self.text), 1.0)
        write(draw, (self.edge, self.edge), title, 1.5 * self.text * min(1.0, (size[0] - 2 * self.edge) / wide))
        write(draw, (self.edge, self.edge + 2.0 * self.text), subtitle, self.text, colour=FAINT)

    def room(self, aspect: float) -> Box:
        """Where a map of an aspect goes: as large as it can be, left of the bar."""
        wide, high = self.image.size
        left, top = self.edge, self.edge + round(3.8 * self.text)
        right, bottom = wide - self.edge - round(5.5 * self.text), high - self.edge
        across = max(8, min(right - left, round((bottom - top) * aspect)))
        down = max(8, min(bottom - top, round(across / aspect)))
        x, y = left + (right - left - across) // 2, top + (bottom - top - down) // 2
        return x, y, x + across, y + down

    def finished(
        self, values: NDArray[np.float64], pixel: float, box: Box, lines: float | None, path: PathLike | None
    ) -> Image.Image:
        """The page with its map, (rows, columns) of distances, `pixel` wide each."""
        known = values[np.isfinite(values)]
        if known.size == 0:
            raise TruefieldError("there is no distance anywhere in the slice; choose another place")
        span = float(min(known.min(), 0.0)), float(max(known.max(), 0.0))
        if span[0] == span[1]:
            span = span[0], span[0] + 1.0
        if lines is None:
            places = ticks(*span, most=_LINES)
            lines = places[1] - places[0] if len(places) > 1 else span[1] - span[0]
        if not (lines > 0 and np.isfinite(lines)):
            raise TruefieldError(f"lines are {lines} apart; give a positive length")
        colours = _paint(values, span).astype(np.float64)
        ink = _ink(values, pixel, lines, self.text)[..., None]
        colours = colours * (1.0 - ink) + _LINE * ink
        colours[~np.isfinite(values)] = 255.0
        self.image.paste(Image.fromarray(np.rint(colours).astype(np.uint8)), box[:2])
        ImageDraw.Draw(self.image).rectangle((box[0] - 1, box[1] - 1, box[2], box[3]), outline=INK)
        bar = self.image.width - self.edge - round(4.2 * self.text)
        top = self.edge + round(3.8 * self.text)
        bottom = self.image.height - self.edge
        colour_bar(
            self.image,
            (bar, top, bar + round(0.9 * self.text), bottom),
            span,
            self.text,
            [],
            paint=lambda v: _paint(v, span),
        )
        if path is not None:
            with replacing(path) as stream:
                self.image.save(stream, format="PNG")
        return self.image


def _paint(values: NDArray[np.float64], span: tuple[float, float]) -> NDArray[np.uint8]:
    """(..., 3) colours of distances from span[0], at most 0, to span[1], at least 0."""
    far = max(span[1], -span[0])
    steps = np.linspace(0.0, 1.0, 256)[:, None]
    tables = []
    for (near, deep), reach in ((_INSIDE, -span[0]), (_OUTSIDE, span[1])):
        # The lesser side changes no faster than the other.
        share = 0.5 + 0.5 * reach / far
        lab = np.asarray(near) + steps * share * (np.asarray(deep) - np.asarray(near))
        tables.append(np.rint(np.clip(from_oklab(lab), 0.0, 255.0)).astype(np.uint8))
    data = np.nan_to_num(values, posinf=span[1], neginf=span[0])
    inside = np.clip(data / min(span[0], -1e-300), 0.0, 1.0)
    outside = np.clip(data / max(span[1], 1e-300), 0.0, 1.0)
    pick = np.rint(255 * np.where(data < 0, inside, outside)).astype(np.int64)
    colours: NDArray[np.uint8] = np.where((data < 0)[..., None], tables[0][pick], tables[1][pick])
    return colours


def _ink(values: NDArray[np.float64], pixel: float, lines: float, text: float) -> NDArray[np.float64]:
    """How much of each pixel the lines cover, 0 to 1: distances say how far a line is, smoothly."""
    data = np.nan_to_num(values, posinf=0.25 * lines, neginf=0.25 * lines)
    level = np.rint(data / lines)
    # Where two fronts meet the distance hardly changes: its slope tells how far a line really is.
    slope = np.hypot(*np.gradient(data)) / pixel if min(data.shape) > 1 else np.ones_like(data)
    away = np.abs(data - level * lines) / (pixel * np.clip(slope, 0.2, 1.0))
    half = np.where(level == 0, 0.075, 0.03) * text
    # Lines closer than they are wide would be a grey mass.
    strength = np.where(level == 0, 0.95, 0.55) * min(1.0, lines / pixel / 6.0)
    return np.clip(half + 0.5 - away, 0.0, 1.0) * strength


def _box(field: Field) -> tuple[Floats, Floats]:
    if isinstance(field, SampledField):
        low = field.origin
        high = low + (np.asarray(field.shape) - 1) * field.spacing
    elif isinstance(field, Surface | CompleteField):
        low, high = field.mesh.extent
        margin = 0.06 * float(np.max(high - low))
        low, high = low - margin, high + margin
    else:
        raise TruefieldError(f"a slice goes through a field, not through {type(field).__name__}")
    if not np.all(high > low):
        raise TruefieldError("the field is flat along an axis; give one with at least two samples along each")
    return low, high
