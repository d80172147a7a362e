"""`truefield info`: what a mesh is, and what is wrong with it."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from truefield.cli.options import Part, Sign, SignRule, Threads, Weld, load
from truefield.cli.progress import progress

if TYPE_CHECKING:
    from truefield.check import MeshCheck
    from truefield.mesh import TriangleMesh

# From this longest side on, a part is more likely drawn in the next unit.
_UNITS: Final = ((0.005, "no unit at all"), (0.5, "metres"), (5.0, "inches or metres"), (10_000.0, "millimetres"))
_BEYOND: Final = "micrometres"


def info(
    part: Part,
    *,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON with stable keys instead of text.")] = False,
    sign: SignRule = Sign.AUTO,
    weld: Weld = None,
    threads: Threads = None,
) -> None:
    """Size, shells, sign rule, and what is wrong with the mesh.

    Nothing is repaired; a mesh is welded only if `--weld` asks for it.
    """
    import truefield as tf

    mesh = load(part, weld)
    with progress() as report:
        check = mesh.check(threads=threads, progress=report)
        rule = tf.Surface(mesh, sign=sign.value, threads=threads, progress=report).sign_rule
    lower, upper = mesh.extent
    longest = float((upper - lower).max())
    facts: dict[str, Any] = {
        "file": str(part),
        "triangles": len(mesh.triangles),
        "vertices": len(mesh.vertices),
        "lower": lower.tolist(),
        "upper": upper.tolist(),
        "size": (upper - lower).tolist(),
        "units_guess": guess_units(longest),
        "sign_rule": {"name": rule.name, "reason": rule.reason},
        "check": asdict(check),
        "weld_hint": weld_hint(mesh, check),
        "problems": check.problems(),
    }
    typer.echo(json.dumps(facts, indent=2) if as_json else _told(facts))


def weld_hint(mesh: TriangleMesh, check: MeshCheck) -> float | None:
    """The length within which welding closes open edges, if single precision, that of STL, explains them; or None."""
    if not check.open_edges.count:
        return None
    import numpy as np

    from truefield.errors import TruefieldError

    within = float(f"{2.0 * np.abs(mesh.vertices).max() * np.finfo(np.float32).eps:.1g}")
    try:
        left = mesh.weld(within).check().open_edges.count
    except TruefieldError:
        return None
    return within if left < check.open_edges.count else None


def guess_units(longest: float) -> str:
    """The unit that a part with this longest side was most likely drawn in; nothing but a guess from the size."""
    return next((unit for limit, unit in _UNITS if longest < limit), _BEYOND)


def _told(facts: dict[str, Any]) -> str:
    check, rule = facts["check"], facts["sign_rule"]
    size, lower, upper = (" x ".join(f"{x:.6g}" for x in facts[key]) for key in ("size", "lower", "upper"))
    spread = f"{size}, from ({lower.replace(' x', ',')}) to ({upper.replace(' x', ',')})"
    measures = f"area {check['area']:.6g}" + (f", volume {check['volume']:.6g}" if check["watertight"] else "")
    rows = [
        ("triangles", f"{facts['triangles']:,} on {facts['vertices']:,} vertices".replace(",", " ")),
        ("size", spread),
        ("units", f"{facts['units_guess']}? Guessed from the size alone; answers are in the model's own unit"),
        ("shells", f"{check['shells']}, {'watertight' if check['watertight'] else 'not watertight'}; {measures}"),
        ("sign rule", f"{rule['name']}: {rule['reason']}"),
    ]
    rows += [("problem", sentence) for sentence in facts["problems"]] or [("problems", "none found")]
    if facts["weld_hint"] is not None:
        rows.append(("hint", f"corners are apart by less than single precision tells: --weld {facts['weld_hint']:g}"))
    return "\n".join([facts["file"], *(f"  {name:<11}{text}" for name, text in rows)])
