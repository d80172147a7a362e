"""Collision and clearance: how far two solids are apart, or how deep they overlap, and where."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from truefield import _truefield, arguments
from truefield.adaptive import AdaptiveField
from truefield.arguments import Floats, Progress
from truefield.fields import Part
from truefield.shape import Shape
from truefield.shape import shape as as_shape

State = Literal["separated", "penetrating", "touching or undecided"]

_BUDGET = 1_000_000


@dataclass(frozen=True, slots=True)
class Collision:
    """How two solids lie to each other.

    Attributes:
        state: "separated": no point belongs to both; "penetrating": they share inner points; "touching or undecided":
            to the tolerance, or to what the solids' own bounds leave open, it cannot be said.
        lower: not above the separation, model units: the length of the shortest way from one to the other or,
            negative, the radius of the largest ball that lies in both.
        upper: not below the separation.
        point_a: (3,) where they are separated, the end of the shortest way found on the first; else the deepest common
            point found.
        point_b: the same on the second.
        boxes: how many boxes were asked about.
    """

    state: State
    lower: float
    upper: float
    point_a: Floats
    point_b: Floats
    boxes: int


def collide(
    a: Part | Shape | AdaptiveField,
    b: Part | Shape | AdaptiveField,
    tolerance: float | None = None,
    *,
    budget: int = _BUDGET,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Collision:
    """Whether two solids meet, with a certified interval of their separation and the points where they are nearest.

    Args:
        a: a mesh, a Surface, a Shape or an adaptive field.
        b: the other.
        tolerance: how wide the interval may be, model units; a thousandth of the smaller solid's diagonal by default.
        budget: the most boxes to ask about: where it is used up the interval is wider, and still certain.
        threads: worker threads; the answer never depends on them.
        progress: called as `progress(phase, fraction)`.

    Searches pairs of boxes, best first, for the shortest way from one solid to the other, each box with the plane that
    its solid stays behind; and where they may meet, boxes of both for the deepest common point. Fields, meshes and most
    shapes tell such planes, so that faces that run in parallel are told apart by large boxes; functions, formulas and
    patches tell none, and for them the number of boxes grows with the square of such faces' size over the tolerance.
    A field built in a domain that cuts its solid is known there only: contact beyond may be undecided.
    Where fields leave more open than the tolerance, the search ends when asking on tells no more.

    Raises:
        TruefieldError: an argument cannot be used, or neither solid has an end.
    """
    if tolerance is None:
        sizes = [float(np.linalg.norm(box[1] - box[0])) for box in map(_extent, (a, b)) if box is not None]
        tolerance = 1e-3 * min(sizes, default=1.0)
    state, lower, upper, first, second, boxes = _truefield.collide(
        _solid(a),
        _solid(b),
        arguments.length("tolerance", tolerance),
        arguments.count("budget", budget, least=1),
        threads,
        progress,
    )
    return Collision(state, lower, upper, np.array(first), np.array(second), boxes)


def _solid(given: Part | Shape | AdaptiveField) -> _truefield.Shape | _truefield.AdaptiveField:
    return given._native if isinstance(given, Shape | AdaptiveField) else as_shape(given)._native


def _extent(given: Part | Shape | AdaptiveField) -> tuple[Floats, Floats] | None:
    return given.extent if isinstance(given, Shape | AdaptiveField) else as_shape(given).extent
