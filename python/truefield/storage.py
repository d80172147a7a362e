"""Fields in files: saved and loaded, they answer the same, bit for bit. `truefield.container` is the file itself.

A complete field's header has `kind` "complete" (or none), `name` of the part, `sign` that was asked for and the
`sign_rule` it led to, `region`, and `origin`, `cell_size`, `first` and `shape` of the grid, cell (0, 0, 0) of the whole
at `origin`, the field's first at `first`. Its arrays: `vertices` (n, 3) float64 and `mesh_triangles` (m, 3) uint32 are
the mesh; the rest are the lists, block after block of 8 x 8 x 8 cells, x slowest, as
`crates/truefield/src/field/parts.rs` describes them. The tree and the sign rule are made anew from the mesh on loading,
the same each time.

A sampled field's header has `kind` "sampled", `origin`, `spacing` and `shape` of the lattice, `known`: how the truth is
known, with its `length` (null: infinite): "exact" within a band, "error" of every sample, or "bounds"; and
`continuous`: whether the sign changes at the surface only. Its arrays are flat, x slowest: the numbers of `doubtful`
samples, `values`, `lower` and `upper` (empty but for "bounds").

An adaptive field's header has `kind` "adaptive", `extent` of the root cell, `children` of a cell (8 or 4), `coverage`:
"whole" where the domain holds all of the solid, or "unknown" (also where it is not said), `continuous`, `tolerance`,
`growth` (null: infinite), `max_depth` and `rule` that edits go on to ask, the number of `levels`, `sign_rule` of the
mesh (null where there is none), and `sums`. Its arrays: `vertices` and `mesh_triangles`
of the mesh whose triangles exact leaves name; `edits`, 16 numbers each, as `crates/truefield-python/src/edit.rs` has
them; then, for each level n from the root down, `records_n`, ten numbers for each cell (the values at its corners,
lower and upper error), `cubics_n`, 64 for each tricubic leaf, `ends_n`, `triangles_n` and `sides_n` of the lists of
exact leaves, and `kinds_n` of the cells: 0 with children, which are all in the next level, in order; 1 trilinear, 2
tricubic, 3 exact. The levels from the first to any are a field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, Final, get_args

import numpy as np
from numpy.typing import NDArray

from truefield import _truefield, arguments, container
from truefield.adaptive import AdaptiveField, Rule
from truefield.arguments import Progress
from truefield.container import Arrays, Header, Kept, expect, three
from truefield.errors import FileError, TruefieldError
from truefield.fields import CompleteField, Region, Sign, Surface
from truefield.files import PathLike
from truefield.mesh import TriangleMesh
from truefield.sampled import SampledField

# In the order of the file: large items first, so that each array is aligned.
_COMPLETE: Final = {
    "vertices": Kept("<f8", rows=True),
    "mesh_triangles": Kept("<u4", rows=True),
    "triangles": Kept("<u4"),
    "triangle_counts": Kept("<u2"),
    "list_counts": Kept("<u2"),
    "ends": Kept("<u2"),
    "cells": Kept("<u2"),
    "wide_entries": Kept("<u2"),
    "entries": Kept("|u1"),
    "varied": Kept("|u1"),
}
_ADAPTIVE: Final = {"vertices": Kept("<f8", rows=True), "mesh_triangles": Kept("<u4", rows=True), "edits": Kept("<f8")}
_LEVEL: Final = {
    "records": Kept("<f4"),
    "cubics": Kept("<f4"),
    "ends": Kept("<u4"),
    "triangles": Kept("<u4"),
    "kinds": Kept("|u1"),
    "sides": Kept("|u1"),
}
_MOST_LEVELS: Final = 25
_SAMPLED: Final = {"doubtful": Kept("<u8"), "values": Kept("<f4"), "lower": Kept("<f4"), "upper": Kept("<f4")}


def save(
    field: AdaptiveField | CompleteField | SampledField,
    path: PathLike,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> None:
    """Writes a field to one file, for `load`; see the `save` of its kind."""
    container.write(path, *_stored(field, threads, progress), progress)


def packed(field: AdaptiveField | CompleteField | SampledField) -> bytes:
    """What `save` would write."""
    stream = BytesIO()
    container.pack(stream, *_stored(field, None, None), None)
    return stream.getvalue()


def unpacked(data: bytes) -> AdaptiveField | CompleteField | SampledField:
    """The field that was `packed`."""
    name = Path("a packed field")
    return _field(name, *container.unpack(BytesIO(data), name, _checked), None, None)


def _stored(
    field: AdaptiveField | CompleteField | SampledField, threads: int | None, progress: Progress | None
) -> tuple[Header, Arrays]:
    arrays: Arrays
    if isinstance(field, CompleteField):
        surface, mesh = field.surface, field.mesh
        header: Header = {
            "kind": "complete",
            "name": mesh.name,
            "sign": surface.sign,
            "sign_rule": surface.sign_rule.name,
            "region": field.region,
            "origin": field.origin.tolist(),
            "cell_size": field.cell_size,
            "first": list(field._native.first),
            "shape": list(field.shape),
        }
        arrays = {"vertices": mesh.vertices, "mesh_triangles": mesh.triangles}
        arrays |= _truefield.complete_field_parts(field._native, threads, progress)
        kept = _COMPLETE
    elif isinstance(field, AdaptiveField):
        header, arrays = _adaptive_parts(field, threads, progress)
        kept = _adaptive_kept(header["levels"])
    else:
        known, length, doubtful = field._native.known
        header = {
            "kind": "sampled",
            "origin": field.origin.tolist(),
            "spacing": field.spacing.tolist(),
            "shape": list(field.shape),
            "known": known,
            "length": length if np.isfinite(length) else None,
            "continuous": field._native.continuous,
        }
        none = np.empty(0, np.float32)
        bounds = (field.lower, field.upper) if known == "bounds" else (none, none)
        arrays = {"doubtful": doubtful, "values": field.values, "lower": bounds[0], "upper": bounds[1]}
        arrays = {name: array.reshape(-1) for name, array in arrays.items()}
        kept = _SAMPLED
    return header, {name: np.ascontiguousarray(arrays.pop(name), dtype) for name, (dtype, _) in kept.items()}


def load(
    path: PathLike, *, depth: int | None = None, threads: int | None = None, progress: Progress | None = None
) -> AdaptiveField | CompleteField | SampledField:
    """Reads a field that `save` wrote: a complete, sampled or adaptive one, with the same answers, bit for bit.

    With `depth`, no more of an adaptive field is read than cells down to that depth: a coarser field, from the first
    part of the file, of which the rest may be missing.

    The whole file is checked, by length, checksums and every index in it, before anything is answered. Takes no more
    than twice the memory of the field, and the time to read the file and, for a complete field, to make the surface's
    tree anew.

    Raises:
        FileError: the file cannot be read, is no such field, truncated, damaged, or from a newer truefield.
    """
    # Later on, the file would be blamed.
    if threads is not None and threads < 1:
        raise TruefieldError(f"threads must be at least 1, or None for all cores, not {threads}")
    file = Path(path)
    first: Callable[[Header], int] | None = None
    if depth is not None:
        deepest = arguments.count("depth", depth, least=0)

        def first(header: Header) -> int:
            if _kind(header) != "adaptive":
                raise FileError(f"'{file}' is no adaptive field, so it has no levels; load it without depth")
            return len(_ADAPTIVE) + len(_LEVEL) * min(deepest + 1, int(header["levels"]))

    header, arrays = container.read(file, _checked, progress, first)
    return _field(file, header, arrays, threads, progress)


def _field(
    file: Path, header: Header, arrays: Arrays, threads: int | None, progress: Progress | None
) -> AdaptiveField | CompleteField | SampledField:
    try:
        if _kind(header) == "adaptive":
            return _adaptive(header, arrays, threads, progress)
        if _kind(header) == "sampled":
            return _sampled(header, arrays)
        return _complete(file, header, arrays, threads, progress)
    except FileError:
        raise
    except TruefieldError as error:
        raise FileError(f"'{file}' is no valid field: {error}; build the field again") from None


def _complete(
    file: Path, header: Header, arrays: Arrays, threads: int | None, progress: Progress | None
) -> CompleteField:
    mesh = TriangleMesh(arrays.pop("vertices"), arrays.pop("mesh_triangles").astype(np.int64), header["name"])
    surface = Surface(mesh, header["sign"], threads=threads, progress=progress)
    if surface.sign_rule.name != header["sign_rule"]:
        raise FileError(
            f"'{file}' was built with the sign rule '{header['sign_rule']}', but this truefield chooses "
            f"'{surface.sign_rule.name}' for its mesh; build the field again"
        )
    native = _truefield.complete_field_from_parts(
        surface._native,
        header["origin"],
        header["cell_size"],
        header["first"],
        header["shape"],
        header["region"],
        arrays,
        threads,
        progress,
    )
    return CompleteField(native, surface)


def _adaptive_kept(levels: int) -> dict[str, Kept]:
    return _ADAPTIVE | {f"{name}_{level}": kept for level in range(levels) for name, kept in _LEVEL.items()}


def _adaptive_parts(
    field: AdaptiveField, threads: int | None, progress: Progress | None
) -> tuple[Header, dict[str, NDArray[Any]]]:
    about, levels = _truefield.adaptive_field_levels(field._native, threads, progress)
    mesh = field._native.mesh
    vertices, triangles, rule = mesh or (np.empty((0, 3)), np.empty((0, 3), np.int64), None)
    arrays = {"vertices": vertices, "mesh_triangles": triangles, "edits": about.pop("edits")}
    arrays |= {f"{name}_{number}": level[name] for number, level in enumerate(levels) for name in _LEVEL}
    growth = about.pop("growth")
    header = {
        "kind": "adaptive",
        **about,
        "growth": growth if np.isfinite(growth) else None,
        "levels": len(levels),
        "sign_rule": rule,
        "sums": True,
    }
    return header, arrays


def _adaptive(header: Header, arrays: Arrays, threads: int | None, progress: Progress | None) -> AdaptiveField:
    surface = None
    if header["sign_rule"] is not None:
        mesh = TriangleMesh(arrays["vertices"], arrays["mesh_triangles"].astype(np.int64))
        surface = Surface(mesh, header["sign_rule"], threads=threads, progress=progress)._native
    names = ("extent", "children", "continuous", "tolerance", "max_depth", "rule")
    growth = np.inf if header["growth"] is None else header["growth"]
    about = {name: header[name] for name in names} | {"growth": growth, "edits": arrays["edits"]}
    about["coverage"] = header.get("coverage", "unknown")
    read = sum(name.startswith("records_") for name in arrays)
    # Each level is let go when it was read: then no more is held than twice the field.
    levels = ({name: arrays.pop(f"{name}_{number}") for name in _LEVEL} for number in range(read))
    return AdaptiveField(_truefield.adaptive_field_from_levels(about, levels, surface, threads, progress))


def _sampled(header: Header, arrays: Arrays) -> SampledField:
    shape, length = header["shape"], np.inf if header["length"] is None else header["length"]
    counts = {name: arrays[name].size for name in ("values", "lower", "upper")}
    whole = int(np.prod(shape, dtype=object))
    bounds = header["known"] == "bounds"
    if counts != {"values": whole, "lower": whole * bounds, "upper": whole * bounds}:
        raise TruefieldError(f"its samples do not fill {shape[0]} x {shape[1]} x {shape[2]}")
    cubes = {name: arrays[name].reshape(shape) for name, count in counts.items() if count}
    known: dict[str, Any] = {"error": {"error": length}, "exact": {"band": length, "doubtful": arrays["doubtful"]}}.get(
        header["known"], {}
    )
    continuous = header["continuous"]
    native = _truefield.SampledField(
        cubes.pop("values"), header["origin"], header["spacing"], **known, **cubes, continuous=continuous
    )
    return SampledField(native)


def _kind(header: Header) -> str:
    return str(header.get("kind", "complete"))


def _checked(header: Header) -> Mapping[str, Kept]:
    """The arrays of the kind of field that the header names, if each of its values is as it must be."""
    kind = _kind(header)
    if kind not in ("adaptive", "complete", "sampled"):
        raise ValueError(f"kind is {kind!r:.80}")
    if kind == "adaptive":
        expect(
            header, "extent", lambda box: isinstance(box, list) and len(box) == 2 and all(three(c, float) for c in box)
        )
        expect(header, "children", lambda children: children in (4, 8))
        expect(header, "continuous", lambda continuous: isinstance(continuous, bool))
        if "coverage" in header:
            expect(header, "coverage", lambda coverage: coverage in ("whole", "unknown"))
        expect(header, "tolerance", lambda tolerance: isinstance(tolerance, float))
        expect(header, "growth", lambda growth: growth is None or isinstance(growth, float))
        expect(header, "max_depth", lambda depth: type(depth) is int and 0 <= depth < _MOST_LEVELS)
        expect(header, "rule", lambda rule: rule in get_args(Rule))
        expect(header, "levels", lambda levels: type(levels) is int and 0 < levels <= _MOST_LEVELS)
        expect(header, "sign_rule", lambda rule: rule is None or rule in get_args(Sign))
        expect(header, "sums", lambda sums: isinstance(sums, dict))
        return _adaptive_kept(header["levels"])
    expect(header, "origin", lambda origin: three(origin, float))
    expect(header, "shape", lambda shape: three(shape, int) and all(0 < n < 2**32 for n in shape))
    if kind == "sampled":
        expect(header, "spacing", lambda spacing: three(spacing, float))
        expect(header, "known", lambda known: known in ("exact", "error", "bounds"))
        expect(header, "length", lambda length: length is None or isinstance(length, float))
        expect(header, "continuous", lambda continuous: isinstance(continuous, bool))
        return _SAMPLED
    expect(header, "name", lambda name: isinstance(name, str))
    expect(header, "sign", lambda sign: sign in get_args(Sign))
    expect(header, "sign_rule", lambda rule: isinstance(rule, str))
    expect(header, "region", lambda region: region in get_args(Region))
    expect(header, "cell_size", lambda size: isinstance(size, float))
    expect(header, "first", lambda first: three(first, int) and all(abs(i) < 2**62 for i in first))
    return _COMPLETE
