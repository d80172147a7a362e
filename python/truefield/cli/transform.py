"""`truefield transform`: how far the voxels of a scan are from its background."""

from __future__ import annotations

import math
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from truefield.cli.options import Lower, Threads, Upper, Written, check_apart, path
from truefield.cli.progress import progress


class Placing(str, Enum):
    """From where to where distances go."""

    CENTERS = "centers"
    BETWEEN = "between"


class Beyond(str, Enum):
    """What lies beyond the image."""

    NOTHING = "nothing"
    BACKGROUND = "background"
    FOREGROUND = "foreground"


class Method(str, Enum):
    """How distances are found."""

    EXACT = "exact"
    WAVEFRONT = "wavefront"
    MARCHING = "marching"


def transform(
    volume: Annotated[
        Path,
        typer.Argument(
            metavar="IMAGE",
            show_default=False,
            parser=path,
            help="An image or volume: .nrrd, .nii, .nii.gz, .vti, .npz, .npy, .tif, .png or .zarr.",
        ),
    ],
    *,
    output: Written,
    threshold: Annotated[
        float | None,
        typer.Option("--threshold", show_default="not 0", help="Foreground is what is above this, not what is not 0."),
    ] = None,
    signed: Annotated[
        bool, typer.Option("--signed", help="Background has distances too, and those of the foreground are negative.")
    ] = False,
    labels: Annotated[
        bool, typer.Option("--labels", help="Distances to the nearest voxel of any other value.")
    ] = False,
    surface: Annotated[
        Placing, typer.Option("--surface", help="From centre to centre, or to the faces `between` voxels.")
    ] = Placing.CENTERS,
    border: Annotated[Beyond, typer.Option("--border", help="What lies beyond the image.")] = Beyond.NOTHING,
    periodic: Annotated[bool, typer.Option("--periodic", help="The image goes on with its other end.")] = False,
    lower: Lower = None,
    upper: Upper = None,
    method: Annotated[
        Method, typer.Option("--method", help="How distances are found; `marching` is not exact everywhere.")
    ] = Method.EXACT,
    threads: Threads = None,
) -> None:
    """The Euclidean distance transform of an image or volume, in its own units and place.

    Bounds enclose the distance to the surface that the voxels stand for, wherever it runs through them.
    """
    import numpy as np

    import truefield as tf
    from truefield.volume import check

    check_apart(output, lower, upper)
    if threshold is not None and math.isnan(threshold):
        raise tf.TruefieldError("--threshold is nan; give a number")
    image = tf.read_volume(volume)
    result = image.holding(np.broadcast_to(np.float32(0), image.shape))
    for wanted in (output, lower, upper):
        if wanted is not None:
            check(wanted, result)
    values = image.values if threshold is None else image.values > threshold
    bounds = lower is not None or upper is not None
    with progress() as report:
        made = tf.distance_transform(
            values,
            # The matrix counts turned axes in; where they are straight, the spacing is the exact one.
            sampling=image.spacing if image.straight else None,
            affine=None if image.straight else image.directions.T,
            signed=signed,
            target="other_label" if labels else "background",
            surface=surface.value,
            border=border.value,
            periodic=periodic,
            method=method.value,
            return_bounds=bounds,
            threads=threads,
            progress=report,
        )
    distances = np.asarray(made)
    image.holding(distances).write(output)
    for wanted, bound in ((lower, "lower"), (upper, "upper")):
        if wanted is not None:
            image.holding(getattr(made, bound)).write(wanted)
    counts = " x ".join(map(str, image.shape))
    inside = int(np.count_nonzero(values))
    typer.echo(f"{output}: {counts} samples, {inside} in the foreground, distances to {float(distances.max()):.6g}")
    if isinstance(made, tf.DistanceTransform) and made.passes is not None:
        typer.echo(f"{made.passes} passes until nothing changed")
    if np.isinf(distances).all():
        typer.echo("all voxels are of one kind, so there is nothing to be near to: all distances are infinite")
