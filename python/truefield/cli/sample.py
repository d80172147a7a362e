"""`truefield sample`: the distances of a part as a volume."""

from __future__ import annotations

from enum import Enum
from typing import Annotated

import typer

from truefield.cli.options import Askable, Lower, Sign, SignRule, Threads, Upper, Weld, Written, check_apart, ready
from truefield.cli.progress import progress


class Method(str, Enum):
    """How samples are found."""

    EXACT = "exact"
    WAVEFRONT = "wavefront"


def sample(
    part: Askable,
    *,
    output: Written,
    resolution: Annotated[
        int | None, typer.Option("--resolution", show_default="256", help="Samples along the longest side.")
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option("--spacing", show_default=False, help="Or the distance of neighbouring samples, in model units."),
    ] = None,
    band: Annotated[
        float | None,
        typer.Option("--band", show_default="none", help="Cut distances off beyond this, plus and minus; quicker."),
    ] = None,
    method: Annotated[
        Method, typer.Option("--method", help="`exact`, or a `wavefront` from the voxels that the surface touches.")
    ] = Method.EXACT,
    margin: Annotated[
        float, typer.Option("--margin", help="How far samples go beyond the box of the part, in model units.")
    ] = 0.0,
    lower: Lower = None,
    upper: Upper = None,
    sign: SignRule = Sign.AUTO,
    weld: Weld = None,
    threads: Threads = None,
) -> None:
    """The distances of a part on a lattice, for programs that want a volume.

    Each sample is exact and rounded to single precision, negative inside; a wavefront's are within their bounds.
    """
    import numpy as np

    import truefield as tf
    from truefield import volume

    check_apart(output, lower, upper)
    one = tf.Volume(np.zeros((1, 1, 1), np.float32), origin=(0.5, 0.5, 0.5))
    for path in (output, lower, upper):
        if path is not None:
            volume.check(path, one)
    with progress() as report:
        surface = ready(part, weld, sign, threads, report)
        field = tf.sampled_field(
            surface,
            resolution,
            spacing,
            band=band,
            method=method.value,
            margin=margin,
            threads=threads,
            progress=report,
        )
    made = field.volume()
    made.write(output)
    for path, bound in ((lower, "lower"), (upper, "upper")):
        if path is not None:
            made.holding(getattr(field, bound)).write(path)
    x, y, z = field.shape
    least, most = float(made.values.min()) + 0.0, float(made.values.max()) + 0.0
    typer.echo(f"{output}: {x} x {y} x {z} samples {field.spacing[0]:.6g} apart, from {least:.6g} to {most:.6g}")
    typer.echo(f"sign rule: {surface.sign_rule.name}, {surface.sign_rule.reason}")
