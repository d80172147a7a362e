"""`truefield contour`: the surface at a depth below the skin of a part."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from truefield.cli.options import Askable, Sign, SignRule, Threads, Weld, path, ready
from truefield.cli.progress import progress


class Placement(str, Enum):
    """Where the points of a contour lie."""

    LATTICE = "lattice"
    PROJECTED = "projected"


def contour(
    part: Askable,
    *,
    depth: Annotated[
        float,
        typer.Option("--depth", show_default=False, help="How deep below the skin; negative: how far outside it."),
    ],
    tolerance: Annotated[
        float,
        typer.Option("--tolerance", show_default=False, help="The largest error and the largest gap, in model units."),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", show_default=False, parser=path, help="What to write: .ply, .csv or .xyz.")
    ],
    placement: Annotated[
        Placement,
        typer.Option("--placement", help="`lattice`: on an even lattice; `projected`: moved onto the contour itself."),
    ] = Placement.LATTICE,
    sign: SignRule = Sign.AUTO,
    weld: Weld = None,
    threads: Threads = None,
) -> None:
    """The contour at a depth, as points with normals.

    Every point lies within half the tolerance of the depth, and every place of the contour within the tolerance of a
    point.
    """
    import truefield as tf
    from truefield import files
    from truefield.formats import table

    table.check(output)
    files.check_file(output)
    with progress() as report:
        surface = ready(part, weld, sign, threads, report)
        cloud = surface.contour(-depth, tolerance, placement=placement.value, threads=threads, progress=report)
    if len(cloud) == 0:
        place = "inside" if depth > 0 else "outside"
        raise tf.TruefieldError(f"no place {place} '{part}' is {abs(depth):g} from its surface; choose another --depth")
    cloud.write(output)
    typer.echo(f"{output}: {len(cloud)} points at depth {depth:g}, each within {tolerance / 2:g} of it")
    typer.echo(f"sign rule: {surface.sign_rule.name}, {surface.sign_rule.reason}")
