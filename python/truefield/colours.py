"""Colours that mean numbers: an even colour map and colours to tell things apart, made in OKLab."""

from __future__ import annotations

from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield.errors import TruefieldError

Array = NDArray[np.float64]
Colour = tuple[int, int, int]

# Ottosson 2020, "A perceptual color space for image processing": linear sRGB to cone responses, their roots to L, a, b.
_TO_CONES: Final = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB: Final = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)

# The even map: lightness, and the hues (degrees) at its dark and bright end.
_LIGHTNESS: Final = (0.30, 0.92)
_HUES: Final = (308.0, 108.0)


def to_oklab(colours: ArrayLike) -> Array:
    """OKLab coordinates (..., 3) of sRGB colours (..., 3) given as 0 to 255."""
    codes = np.asarray(colours, dtype=np.float64) / 255.0
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    lab: Array = np.cbrt(linear @ _TO_CONES.T) @ _TO_LAB.T
    return lab


def from_oklab(lab: ArrayLike) -> Array:
    """sRGB colours (..., 3), 0 to 255 as float64 and not clipped, of OKLab coordinates (..., 3)."""
    cones = np.linalg.solve(_TO_LAB, np.asarray(lab, dtype=np.float64)[..., None])[..., 0] ** 3
    linear = np.linalg.solve(_TO_CONES, cones[..., None])[..., 0]
    bright = 1.055 * np.maximum(linear, 0.0031308) ** (1.0 / 2.4) - 0.055
    return 255.0 * np.where(linear <= 0.0031308, 12.92 * linear, bright)


def even_path(count: int) -> Array:
    """(count, 3) OKLab colours from dark violet over teal to bright yellow, all within the screen's gamut.

    Lightness rises in equal steps and so does the difference between neighbours: the hue turns by as much as is
    left of each step when lightness and chroma have had their share.

    Raises:
        TruefieldError: count is below 2.
    """
    if count < 2:
        raise TruefieldError(f"a colour map needs at least 2 colours, not {count}")
    fine = np.linspace(*_LIGHTNESS, 4096)
    # Chroma is least where the screen has least: teal.
    chroma = 0.094 + 0.45 * (fine - 0.58) ** 2
    slope = 0.90 * (fine - 0.58)
    wanted = np.radians(_HUES[0] - _HUES[1])

    def turned(step: float) -> Array:
        rate = np.sqrt(np.maximum(step * step - 1.0 - slope * slope, 0.0)) / chroma
        return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(fine))])

    low, high = 1.0, 3.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if turned(middle)[-1] < wanted else (low, middle)
    hue = np.radians(_HUES[0]) - turned(high)
    at = np.linspace(*_LIGHTNESS, count)
    radius, angle = np.interp(at, fine, chroma), np.interp(at, fine, hue)
    return np.stack([at, radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


@lru_cache(maxsize=8)
def even_map(count: int = 256) -> NDArray[np.uint8]:
    """(count, 3) uint8 colours of the even path, read-only: equal steps of the value look equal, in grey print too.

    Raises:
        TruefieldError: count is below 2.
    """
    result = np.rint(from_oklab(even_path(count))).astype(np.uint8)
    result.flags.writeable = False
    return result


def colours_of(values: ArrayLike, low: float, high: float) -> NDArray[np.uint8]:
    """(..., 3) uint8 colours of values by the even map from `low` to `high`; values beyond take the end colours."""
    steps = even_map()
    place = (np.asarray(values, dtype=np.float64) - low) / (high - low)
    index = np.rint(np.clip(np.nan_to_num(place), 0.0, 1.0) * (len(steps) - 1)).astype(np.int64)
    return steps[index]


def distinct(count: int) -> list[Colour]:
    """Colours of like lightness that can be told apart, warm ones first; neighbours in the list differ most."""
    result: list[Colour] = []
    for index in range(count):
        hue = np.radians(45.0 + 137.508 * index)
        lightness = (0.66, 0.56, 0.75)[index % 3]
        chroma = 0.17
        # Less chroma where the screen cannot show it.
        while True:
            rgb = from_oklab([lightness, chroma * np.cos(hue), chroma * np.sin(hue)])
            if rgb.min() >= 0.0 and rgb.max() <= 255.0:
                break
            chroma *= 0.97
        red, green, blue = np.rint(rgb).astype(int).tolist()
        result.append((red, green, blue))
    return result
