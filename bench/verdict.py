"""Largest error and wrong signs of tools that did the same work."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.judge import Judge
from bench.lattice import Floats

# Below this distance, as a fraction of the box's diagonal, a side is a matter of rounding.
UNDECIDED = 1e-9
# Random samples judged, samples judged per tool for its sign and for its distance, pairs of point and triangle in all.
RANDOM, DOUBTFUL, FURTHEST, PAIRS = 2000, 500, 20, 400_000_000

Answers = NDArray[Any]
Rows = NDArray[np.int64]


@dataclass(frozen=True)
class Verdict:
    """What brute force says of one tool; `estimated` where not all doubtful signs could be judged."""

    largest_error: float
    wrong_signs: float
    estimated: bool


def verdicts(
    answers: list[Answers], judge: Judge, points: Callable[[Rows], Floats], band: float | None
) -> list[Verdict]:
    """Judges answers at the same points; NaN is no answer, and a fault only within `band` of the surface.

    Judged by brute force are random samples, for each tool the samples where it is furthest from the first one
    (ours), and samples where its sign differs from the first one's: all of them while they are few, else a
    random part, and the count is scaled up.
    """
    random = np.random.default_rng(7)
    first = np.asarray(answers[0])
    share = PAIRS // len(judge.corners)
    common = min(len(answer) for answer in answers)
    anywhere = random.choice(common, min(common, max(100, min(RANDOM, share))), replace=False)
    chosen, sides, drawn = [anywhere], [], []
    for answer in answers:
        furthest, differing = _doubts(np.asarray(answer), first[: len(answer)], UNDECIDED * judge.diagonal)
        part = min(len(differing), max(50, min(DOUBTFUL, share // 4)))
        sides.append(differing)
        drawn.append(random.choice(differing, part, replace=False))
        chosen += [furthest, drawn[-1]]
    rows = np.unique(np.concatenate(chosen).astype(np.int64))
    where = points(rows)
    truth, inside = judge.distance(where), judge.inside(where)
    decided = truth > UNDECIDED * judge.diagonal
    found = []
    for answer, side, sample in zip(answers, sides, drawn, strict=True):
        asked = rows < len(answer)
        value = np.full(len(rows), np.nan)
        value[asked] = answer[rows[asked]]
        known = np.isfinite(value)
        error = float(np.max(np.abs(np.abs(value[known]) - truth[known]), initial=0.0))
        if band is not None:
            # Left out although in the band; the edge of the band is a matter of rounding.
            lost = ~known & np.isin(rows, anywhere) & (truth < band * (1 - 1e-6))
            error = max(error, float(np.max(band - truth[lost], initial=0.0)))
        wrong = known & decided & ((value < 0) != inside)
        scale = len(side) / len(sample) if len(sample) else 1.0
        # Where it differs from the first, scaled up; elsewhere as found: there both are wrong.
        differs = np.isin(rows, side)
        count = scale * np.sum(wrong & np.isin(rows, sample)) + np.sum(wrong & ~differs)
        found.append(Verdict(error, float(count), len(sample) < len(side)))
    return found


def _doubts(mine: Answers, first: Answers, undecided: float) -> tuple[Rows, Rows]:
    """Rows where two tools are furthest apart in distance, and those where their sides differ."""
    apart = np.abs(np.abs(mine) - np.abs(first))
    apart[~np.isfinite(apart)] = -1.0
    furthest = np.argpartition(apart, -min(FURTHEST, len(apart)))[-FURTHEST:]
    return furthest, np.flatnonzero(((mine < 0) != (first < 0)) & (np.abs(first) > undecided) & np.isfinite(mine))
