"""The arguments that several commands share."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer


class Sign(str, Enum):
    """How inside is told from outside."""

    AUTO = "auto"
    PSEUDONORMAL = "pseudonormal"
    WINDING = "winding"
    UNSIGNED = "unsigned"


Part = Annotated[
    Path,
    typer.Argument(metavar="PART", show_default=False, help="A mesh: .stl, .obj, .ply, .off, .glb, .gltf or .3mf."),
]
SignRule = Annotated[
    Sign, typer.Option("--sign", help="How inside is told from outside; `auto` looks at the mesh and says why.")
]
Threads = Annotated[
    int | None,
    typer.Option("--threads", min=1, show_default="every core", help="Worker threads; the results never depend on it."),
]
