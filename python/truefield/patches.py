"""Surfaces of bicubic Bezier patches, with the closest point to 1e-11 of their size."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from truefield import _truefield
from truefield.arguments import Floats, Progress
from truefield.errors import TruefieldError
from truefield.shape import Shape

# A cubic with these inner control points is off a quarter of a circle by 2.8e-4 of its radius.
_ROUND: Final = 4.0 / 3.0 * (math.sqrt(2.0) - 1.0)
_QUARTER: Final = np.array([(1.0, 0.0), (1.0, _ROUND), (_ROUND, 1.0), (0.0, 1.0)])


def surface(
    control_points: ArrayLike,
    *,
    sides: Literal["closed", "unsigned"] = "closed",
    threads: int | None = None,
    progress: Progress | None = None,
) -> Shape:
    """The shape of bicubic Bezier patches.

    Args:
        control_points: (n, 4, 4, 3) float64: of each patch, four along u of four along v. Patches that share an edge
            have the same control points there. The normal, du x dv, points outward.
        sides: "closed": the patches close up and distances are negative inside. "unsigned": there is no inside and
            distances are positive, as for the paper's teapot, whose walls were made by an offset.
        threads: number of threads; all cores by default.
        progress: called as `progress(phase, fraction)`.

    A distance to the teapot's parts takes one to three microseconds on one core, to patches that bend at random ten
    times as much. Points as far from a large part of the surface as from its nearest point, like the middle of a ball,
    take longer and have wider bounds.

    Raises:
        TruefieldError: the array has another shape, numbers that are not finite, patches smaller than 1e-40 or larger
            than 1e40, or the patches do not close up; when asked, the side of a point next to the surface cannot be
            decided, or the patches are so like a ball around it that a million pieces do not tell how near they are.
    """
    try:
        array = np.ascontiguousarray(control_points, dtype=np.float64)
    except (TypeError, ValueError):
        raise TruefieldError("control points are not numbers; give an array of shape (n, 4, 4, 3)") from None
    if array.ndim != 4 or array.shape[1:] != (4, 4, 3):
        raise TruefieldError(f"control points have shape {array.shape}; give an array of shape (n, 4, 4, 3)")
    native = _truefield.patch_shape(array, sides, threads, progress)
    return Shape(native, f"patches.surface({len(array)} patches)")


def teapot() -> Shape:
    """The solid of `teapot_patches`: body, handle and spout put together."""
    body, handle, spout = (surface(part) for part in teapot_patches())
    return body | handle | spout


def teapot_patches() -> tuple[Floats, Floats, Floats]:
    """The control points, (n, 4, 4, 3) each, of a teapot in the manner of the paper's: body with lid, handle and spout.

    It is 3 units high. Its 68 patches are our own: profiles turned about the z axis, and tubes along curves in the x-z
    plane. Each part closes up by itself; handle and spout begin and end inside the body.
    """
    return _body(), _handle(), _spout()


def _body() -> Floats:
    profile = [
        # Radius and height: foot, belly, shoulder, the groove around the lid, the lid and its knob.
        [(0.0, 0.0), (0.45, 0.0), (0.9, 0.0), (1.15, 0.0)],
        [(1.15, 0.0), (1.3, 0.0), (1.38, 0.06), (1.5, 0.22)],
        [(1.5, 0.22), (1.86, 0.7), (1.95, 1.15), (1.62, 1.72)],
        [(1.62, 1.72), (1.44, 2.0309), (1.3, 2.16), (1.2, 2.22)],
        [(1.2, 2.22), (1.12, 2.268), (1.12, 2.2), (1.06, 2.24)],
        [(1.06, 2.24), (0.72, 2.4667), (0.34, 2.46), (0.2, 2.56)],
        [(0.2, 2.56), (0.06, 2.66), (0.3, 2.7), (0.3, 2.84)],
        [(0.3, 2.84), (0.3, 2.97), (0.12, 3.0), (0.0, 3.0)],
    ]
    return _turned(np.array(profile))


def _handle() -> Floats:
    # Middles of the tube in x and z, from the shoulder around to the belly.
    spine = [
        [(-1.2, 1.78), (-1.75, 1.86), (-2.1, 1.92), (-2.42, 1.9)],
        [(-2.42, 1.9), (-2.86, 1.8725), (-2.92, 1.42), (-2.62, 1.08)],
        [(-2.62, 1.08), (-2.35, 0.774), (-1.9, 0.6), (-1.3, 0.56)],
    ]
    return _tube(np.array(spine), [0.15, 0.16, 0.17, 0.15])


def _spout() -> Floats:
    spine = [
        [(1.2, 0.72), (1.75, 0.72), (2.05, 0.92), (2.2, 1.3)],
        [(2.2, 1.3), (2.335, 1.642), (2.4, 1.98), (2.85, 2.16)],
    ]
    return _tube(np.array(spine), [0.56, 0.34, 0.17])


def _turned(profile: Floats) -> Floats:
    """Patches of profiles (n, 4, 2), radius and height, turned about z."""
    quarters = []
    for turn in range(4):
        cosine, sine = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[turn]
        circle = np.stack(
            [_QUARTER[:, 0] * cosine - _QUARTER[:, 1] * sine, _QUARTER[:, 0] * sine + _QUARTER[:, 1] * cosine], axis=1
        )
        flat = profile[:, None, :, :1] * circle[None, :, None, :]
        height = np.broadcast_to(profile[:, None, :, 1:], (*flat.shape[:3], 1))
        quarters.append(np.concatenate([flat, height], axis=3))
    return np.concatenate(quarters)


def _tube(spine: Floats, radii: list[float]) -> Floats:
    """Patches of a tube along cubics (n, 4, 2) in x and z, with a radius where each begins and ends, and flat ends."""
    patches = []
    for turn in range(4):
        angle = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][turn]
        circle = np.stack(
            [
                _QUARTER[:, 0] * angle[0] - _QUARTER[:, 1] * angle[1],
                _QUARTER[:, 0] * angle[1] + _QUARTER[:, 1] * angle[0],
            ],
            axis=1,
        )
        rings = []
        for cubic, (first, last) in zip(spine, pairwise(radii), strict=True):
            # Rings stay square to the curve at both ends of a piece, so that pieces join smoothly.
            ways = [cubic[1] - cubic[0], cubic[1] - cubic[0], cubic[3] - cubic[2], cubic[3] - cubic[2]]
            columns = [
                _ring(middle, way, radius, circle)
                for middle, way, radius in zip(cubic, ways, (first, first, last, last), strict=True)
            ]
            rings.append(np.stack(columns, axis=1))
        for end, middle, outward in ((rings[0][:, 0], spine[0, 0], False), (rings[-1][:, 3], spine[-1, 3], True)):
            center = np.array([middle[0], 0.0, middle[1]])
            steps = np.array([0.0, 1.0, 2.0, 3.0])[None, :, None] / 3.0
            disc = end[:, None] * (1.0 - steps) + center * steps
            # Ends meet the tube with the very control points of its edge.
            disc[:, 0] = end
            disc[:, 3] = center
            rings.append(disc if outward else disc[:, ::-1])
        patches += rings
    return np.stack(patches)


def _ring(middle: Floats, way: Floats, radius: float, circle: Floats) -> Floats:
    """Control points (4, 3) of a quarter of a circle around a point of a curve in the x-z plane, square to its way."""
    across = np.array([way[1], 0.0, -way[0]]) / math.hypot(way[0], way[1])
    offsets: Floats = circle[:, :1] * across + circle[:, 1:] * np.array([0.0, 1.0, 0.0])
    return np.array([middle[0], 0.0, middle[1]]) + radius * offsets
