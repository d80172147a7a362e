"""Text, ticks and colour bars of pictures: Pillow draws, the sizes come from the picture's."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from truefield.colours import Colour, colours_of

Box = tuple[int, int, int, int]
Anchor = Literal["la", "ma", "ra", "lm", "mm", "rm", "ls", "ms", "rs", "md", "ld", "mb"]

INK: Colour = (38, 43, 50)
FAINT: Colour = (120, 126, 134)
RULE: Colour = (214, 218, 223)
UNKNOWN: Colour = (168, 168, 168)
LIMIT: Colour = (196, 48, 43)


def font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Pillow's own typeface at a size in pixels, at least 9 so that it stays readable."""
    return ImageFont.load_default(max(size, 9.0))


def number(value: float, digits: int = 3) -> str:
    """A number for people: `digits` significant digits, no exponent unless it is needed.

    A negative one has a hyphen: the typeface has no minus sign.
    """
    if not math.isfinite(value):
        return "?"
    text = f"{value:.{digits}g}"
    if "e" in text and 1e-4 <= abs(value) < 1e6:
        text = f"{value:.0f}" if abs(value) >= 1 else f"{value:.6f}".rstrip("0")
    return text


def ticks(low: float, high: float, most: int = 7) -> list[float]:
    """Round numbers (1, 2 or 5 times a power of ten apart) from `low` to `high`, at most `most` of them."""
    span = high - low
    if not (span > 0.0 and math.isfinite(span)) or most < 1:
        return [low]
    power = 10.0 ** math.floor(math.log10(span / most))
    for factor in (1.0, 2.0, 5.0, 10.0, 20.0):
        step = factor * power
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        if last - first + 1 <= most:
            return [index * step for index in range(first, last + 1)]
    return [low]


def tick_labels(places: list[float]) -> list[str]:
    """Labels with as many decimals as the step between the ticks needs, the same for all."""
    if len(places) < 2:
        return [number(place) for place in places]
    step = places[1] - places[0]
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    if decimals > 4 or max(abs(place) for place in places) >= 1e6:
        largest = max(abs(place) for place in places)
        return [
            number(place, math.floor(math.log10(largest)) - math.floor(math.log10(step) + 1e-9) + 1) for place in places
        ]
    return [f"{place:.{decimals}f}" for place in places]


def write(
    draw: ImageDraw.ImageDraw,
    at: tuple[float, float],
    text: str,
    size: float,
    *,
    colour: Colour = INK,
    anchor: Anchor = "la",
) -> None:
    """Writes one line of text; `anchor` as Pillow has it."""
    draw.text(at, text, fill=colour, font=font(size), anchor=anchor)


def width_of(text: str, size: float) -> float:
    """How wide a line of text is, in pixels."""
    return float(font(size).getlength(text))


def wedge(image: Image.Image, tip: tuple[float, float], size: float, direction: float, colour: Colour) -> None:
    """A small smooth triangle whose tip is at `tip` and points along `direction` (degrees, 0 right, 90 down)."""
    scale, half = 8, math.ceil(size) + 2
    mask = Image.new("L", (2 * half * scale, 2 * half * scale))
    x, y = tip[0] - math.floor(tip[0]) + half, tip[1] - math.floor(tip[1]) + half
    angle = math.radians(direction)
    along, across = (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))
    corners = [(x, y)] + [
        (x - size * along[0] + side * 0.55 * size * across[0], y - size * along[1] + side * 0.55 * size * across[1])
        for side in (1.0, -1.0)
    ]
    ImageDraw.Draw(mask).polygon([(cx * scale, cy * scale) for cx, cy in corners], fill=255)
    mask = mask.resize((2 * half, 2 * half), Image.Resampling.BOX)
    image.paste(colour, (math.floor(tip[0]) - half, math.floor(tip[1]) - half), mask)


def colour_bar(
    image: Image.Image,
    box: Box,
    span: tuple[float, float],
    size: float,
    limits: list[tuple[str, float]],
    *,
    paint: Callable[[NDArray[np.float64]], NDArray[np.uint8]] | None = None,
) -> None:
    """An upright bar of colours with ticks on its right and named limits on its left.

    Args:
        image: drawn on.
        box: left, top, right, bottom of the bar itself in pixels.
        span: values at the bottom and the top.
        size: height of the text in pixels.
        limits: name and value; those outside the span are left out.
        paint: colours (n, 3) of values (n,); the even map by default.
    """
    left, top, right, bottom = box
    draw = ImageDraw.Draw(image)
    values = span[1] + (np.arange(bottom - top) + 0.5) / (bottom - top) * (span[0] - span[1])
    colours = colours_of(values, *span) if paint is None else paint(values)
    strip = np.repeat(colours[:, None, :], right - left, axis=1)
    image.paste(Image.fromarray(np.ascontiguousarray(strip)), (left, top))
    draw.rectangle((left - 1, top - 1, right, bottom), outline=INK, width=1)

    def row(value: float) -> float:
        return bottom + (value - span[0]) / (span[1] - span[0]) * (top - bottom)

    places = ticks(*span, most=max(2, min(9, int((bottom - top) / (1.9 * size)))))
    for place, label in zip(places, tick_labels(places), strict=True):
        y = round(row(place))
        draw.line((right, y, right + 0.35 * size, y), fill=INK, width=max(1, round(size / 16)))
        write(draw, (right + 0.65 * size, y), label, size, anchor="lm")
    previous = math.inf
    for name, value in sorted(limits, key=lambda limit: limit[1]):
        if not span[0] <= value <= span[1]:
            continue
        at = row(value)
        draw.line((left, round(at), right, round(at)), fill=(255, 255, 255), width=max(1, round(size / 10)))
        wedge(image, (left - 2, at), 0.6 * size, 0.0, LIMIT)
        # Two limits close to each other keep their labels apart.
        text_y = min(at, previous - 1.2 * size)
        previous = text_y
        write(draw, (left - 0.9 * size, text_y), f"{name} {number(value)}", size, colour=LIMIT, anchor="rm")


def grey_key(image: Image.Image, at: tuple[int, int], side: int, says: str, size: float) -> None:
    """A grey box with what grey means on its right; `at` is its left upper corner."""
    draw = ImageDraw.Draw(image)
    left, top = at
    high = round(1.1 * size)
    draw.rectangle((left - 1, top, left + side, top + high), fill=UNKNOWN, outline=INK)
    write(draw, (left + side + 0.5 * size, top + 0.5 * high), says, size, anchor="lm")


def badge(page: Image.Image, at: tuple[float, float], label: str, text: float, colour: Colour) -> None:
    """A number in a small white disc with a coloured rim."""
    scale, radius = 4, 0.72 * text
    half = math.ceil(radius) + 2
    disc = Image.new("RGBA", (2 * half * scale, 2 * half * scale), (255, 255, 255, 0))
    reach = [(half - radius) * scale, (half - radius) * scale, (half + radius) * scale, (half + radius) * scale]
    ImageDraw.Draw(disc).ellipse(reach, fill=(255, 255, 255, 235), outline=colour, width=round(0.11 * text * scale))
    disc = disc.resize((2 * half, 2 * half), Image.Resampling.BOX)
    page.paste(disc, (round(at[0]) - half, round(at[1]) - half), disc)
    write(ImageDraw.Draw(page), (round(at[0]), round(at[1])), label, 0.9 * text, anchor="mm")
