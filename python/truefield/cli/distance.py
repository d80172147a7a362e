"""`truefield distance`: how far points are from a part."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from truefield.cli.options import Askable, Sign, SignRule, Threads, Weld, path, ready
from truefield.cli.progress import progress


def distance(
    part: Askable,
    *,
    points: Annotated[
        Path,
        typer.Option(
            "--points",
            "-p",
            show_default=False,
            parser=path,
            help="The points: .csv, .xyz, .txt (x, y, z), .npy or .ply.",
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", show_default=False, parser=path, help="What to write: a .csv or .ply, one row a point."
        ),
    ],
    sign: SignRule = Sign.AUTO,
    weld: Weld = None,
    threads: Threads = None,
) -> None:
    """Exact distances of points, with bounds and nearest points.

    Writes the columns x, y, z, distance (negative inside), lower, upper (they contain the true distance and are equal
    where it is exact), nearest_x, nearest_y, nearest_z, triangle and feature (0 face, 1 to 3 edge, 4 to 6 corner).
    """
    import truefield as tf
    from truefield import files
    from truefield.formats import table

    table.check(output)
    files.check_file(output)
    asked = tf.read_points(points)
    with progress() as report:
        surface = ready(part, weld, sign, threads, report)
        nearest = surface.nearest(asked, threads=threads, progress=report)
        lower, upper = surface.bounds(asked, threads=threads, progress=report)
    columns = dict(zip("xyz", asked.T, strict=True))
    columns |= {"distance": nearest.distance, "lower": lower, "upper": upper}
    columns |= dict(zip(("nearest_x", "nearest_y", "nearest_z"), nearest.point.T, strict=True))
    columns |= {"triangle": nearest.triangle, "feature": nearest.feature}
    table.write(output, columns)
    inside, doubtful = int((upper < 0).sum()), int((lower != upper).sum())
    typer.echo(f"{output}: {len(asked)} points, {inside} inside, {doubtful} whose distance is not exact")
    typer.echo(f"sign rule: {surface.sign_rule.name}, {surface.sign_rule.reason}")
