"""Where the panels of a picture go: pure arithmetic on boxes of pixels."""

from __future__ import annotations

from typing import Final, NamedTuple

from truefield.lettering import Box

# Width of the column on the right as a share of the page, and height of the second panel as a share of the column.
_COLUMN: Final = 0.29
_LOWER: Final = 0.45
_SECOND: Final = 0.7


class Layout(NamedTuple):
    """Boxes for a part, for a smaller view of it, and for what explains the colours."""

    part: Box
    second: Box | None
    key: Box


def single(room: Box, aspect: float, key: int, gap: int) -> Layout:
    """The part as large as it goes, and a column `key` wide for the colours on its right."""
    left, top, right, bottom = room
    column = right - key
    return Layout(_within((left, top, column - gap, bottom), aspect), None, (column, top, right, bottom))


def double(room: Box, aspect: float, key: int, gap: int, caption: int) -> Layout:
    """The part and a second view of it, beneath the colours or beneath the part: whichever shows the part larger.

    Args:
        room: left, top, right, bottom.
        aspect: width over height of what both views hold.
        key: least width of the column for the colours.
        gap: between boxes.
        caption: height kept free beneath the second view.
    """
    left, top, right, bottom = room
    wide, high = right - left, bottom - top
    column = right - max(key, round(_COLUMN * wide))
    beside = _within((left, top, column - gap, bottom), aspect)
    lower = _within((column, bottom - caption - round(_LOWER * high), right, bottom - caption), aspect, upright=1.0)
    widest = right - key - gap - left
    tall = high - gap - caption
    side = min(widest, round(tall * aspect / (1.0 + _SECOND)))
    if side <= beside[2] - beside[0]:
        return Layout(beside, lower, (column, top, right, lower[1] - gap))
    cut = bottom - caption - gap - round(_SECOND * side / aspect)
    above = _within((left, top, left + widest, cut), aspect)
    below = (left, cut + gap, left + widest, bottom - caption)
    return Layout(above, _within(below, aspect), (right - key, top, right, bottom))


def _within(box: Box, aspect: float, upright: float = 0.5) -> Box:
    """The largest box of an aspect in the middle of another; `upright` 1 puts it at the bottom."""
    left, top, right, bottom = box
    wide, high = max(right - left, 1), max(bottom - top, 1)
    w = max(min(wide, round(high * aspect)), 1)
    h = max(min(high, round(wide / aspect)), 1)
    x, y = left + (wide - w) // 2, top + round(upright * (high - h))
    return x, y, x + w, y + h
