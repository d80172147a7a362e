"""The arguments that several commands share."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from truefield.cli.progress import Report

if TYPE_CHECKING:
    from truefield.fields import CompleteField, Surface
    from truefield.mesh import TriangleMesh

FIELD_SUFFIX: Final = ".tfield"


def path(given: str) -> Path:
    """The path that a word names; the empty word, as of a shell's unset variable, would name the current folder."""
    if not given:
        raise typer.BadParameter("the name is empty; give the path of a file or folder")
    return Path(given)


class Sign(str, Enum):
    """How inside is told from outside."""

    AUTO = "auto"
    PSEUDONORMAL = "pseudonormal"
    WINDING = "winding"
    UNSIGNED = "unsigned"


Part = Annotated[
    Path,
    typer.Argument(
        metavar="PART", show_default=False, parser=path, help="A mesh: .stl, .obj, .ply, .off, .glb, .gltf or .3mf."
    ),
]
SignRule = Annotated[
    Sign, typer.Option("--sign", help="How inside is told from outside; `auto` looks at the mesh and says why.")
]
Threads = Annotated[
    int | None,
    typer.Option("--threads", min=1, show_default="every core", help="Worker threads; the results never depend on it."),
]
Weld = Annotated[
    float | None,
    typer.Option(
        "--weld",
        show_default="none",
        help="Join vertices whose coordinates differ by no more than this, as an STL with cracks may need.",
    ),
]


Written = Annotated[
    Path,
    typer.Option(
        "--output",
        "-o",
        show_default=False,
        parser=path,
        help="What to write: .nrrd, .nii, .nii.gz, .vti, .npz, .npy, .tif or .zarr.",
    ),
]


Lower = Annotated[
    Path | None,
    typer.Option("--lower", show_default=False, parser=path, help="Also write lower bounds of the distances here."),
]
Upper = Annotated[
    Path | None,
    typer.Option("--upper", show_default=False, parser=path, help="Also write upper bounds of the distances here."),
]


Askable = Annotated[
    Path,
    typer.Argument(
        metavar="PART",
        show_default=False,
        parser=path,
        help="A mesh: .stl, .obj, .ply, .off, .glb, .gltf or .3mf; or a field: .tfield.",
    ),
]


def check_no_mesh(field: Path) -> None:
    """Refuses a mesh where a field is wanted, and says how to make one."""
    from truefield import formats
    from truefield.errors import FileError

    if field.suffix.lower() in formats.READABLE:
        raise FileError(f"'{field}' is a mesh; make a field of it first, with truefield adaptive")


def check_apart(*outputs: Path | None) -> None:
    """Refuses two outputs of the same name, of which the second would replace the first."""
    from truefield.errors import TruefieldError

    given = [output.resolve() for output in outputs if output is not None]
    for number, output in enumerate(given):
        if output in given[:number]:
            raise TruefieldError(f"two outputs go to '{output.name}'; give each a file of its own")


def ready(
    part: Path, weld: float | None, sign: Sign, threads: int | None, report: Report | None
) -> Surface | CompleteField:
    """The part ready to be asked: the field in a `.tfield`, the surface of a mesh in any other file."""
    import truefield as tf

    if part.suffix.lower() != FIELD_SUFFIX:
        return tf.Surface(load(part, weld), sign=sign.value, threads=threads, progress=report)
    if weld is not None or sign is not Sign.AUTO:
        option = "--sign" if weld is None else "--weld"
        raise tf.TruefieldError(f"'{part}' is a field, built with its own mesh and sign rule; leave {option} out")
    field = tf.load(part, threads=threads, progress=report)
    if isinstance(field, tf.AdaptiveField):
        raise tf.TruefieldError(
            f"'{part}' is an adaptive field, which truefield surface and truefield render take; "
            "give a mesh or a complete field"
        )
    if isinstance(field, tf.SampledField):
        raise tf.TruefieldError(f"'{part}' holds samples of distances only; give a mesh or a complete field")
    return field


def load(part: Path, weld: float | None) -> TriangleMesh:
    """The mesh in a file, welded if that is asked for."""
    from truefield.io import read

    mesh = read(part)
    return mesh if weld is None else mesh.weld(weld)
