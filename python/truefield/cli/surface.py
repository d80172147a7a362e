"""`truefield surface`: where a field or a volume of distances has a value, as a mesh."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from truefield.cli.options import FIELD_SUFFIX, Threads, check_no_mesh, path
from truefield.cli.progress import progress

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class Border(str, Enum):
    """What becomes of a surface that reaches the border of the volume."""

    CLOSED = "closed"
    OPEN = "open"


def surface(
    volume: Annotated[
        Path,
        typer.Argument(
            metavar="FIELD",
            show_default=False,
            parser=path,
            help="Distances: .nrrd, .nii, .nii.gz, .vti, .npz, .npy, .tif, .zarr; or a field: .tfield.",
        ),
    ],
    *,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", show_default=False, parser=path, help="What to write: .stl, .obj, .ply or .off."
        ),
    ],
    distance: Annotated[
        float,
        typer.Option(
            "--distance", "--offset", help="The value at the surface, what is below it is inside: how far it is grown."
        ),
    ] = 0.0,
    border: Annotated[
        Border, typer.Option("--border", help="`closed` closes it where the volume ends; `open` leaves a rim.")
    ] = Border.CLOSED,
    threads: Threads = None,
) -> None:
    """The surface at a distance, as a closed mesh.

    Marching cubes of volumes and sampled fields, dual contouring of adaptive ones.
    """
    import truefield as tf
    from truefield import files, formats

    check_no_mesh(volume)
    formats.check(output)
    files.check_file(output)
    with progress() as report:
        if volume.suffix.lower() == FIELD_SUFFIX:
            field = tf.load(volume, threads=threads, progress=report)
        else:
            field = tf.SampledField.from_volume(tf.read_volume(volume))
        if isinstance(field, tf.AdaptiveField):
            if border is Border.OPEN:
                raise tf.TruefieldError("the surface of an adaptive field is always closed; leave --border out")
            mesh = field.surface(distance, threads=threads, progress=report)
        elif isinstance(field, tf.SampledField):
            mesh = field.surface(distance, border=border.value, threads=threads, progress=report)
        else:
            raise tf.TruefieldError(f"'{volume}' is a complete field; it keeps the mesh itself")
    mesh.write(output)
    typer.echo(f"{output}: {len(mesh.triangles)} triangles at distance {distance:g}, {len(mesh.vertices)} vertices")
    if isinstance(field, tf.SampledField) and _is_cut(field.values, distance):
        typer.echo("it reaches the border of the samples and ends there; sample with a larger --margin to see more")


def _is_cut(values: NDArray[np.float32], distance: float) -> bool:
    """Whether some sample of the border is inside."""
    ends = (values[[0, -1]], values[:, [0, -1]], values[:, :, [0, -1]])
    return any(bool((end < distance).any()) for end in ends)
