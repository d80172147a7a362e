"""TIFF as it is written: a picture for each z, not compressed, each straight after its directory."""

from __future__ import annotations

import struct
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from truefield.files import replacing
from truefield.formats.polygons import FormatError
from truefield.formats.volumes import raw

if TYPE_CHECKING:
    from truefield.volume import Volume

_KINDS: Final = {"uint8": 1, "uint16": 1, "int32": 2, "float32": 3}
# Offsets of four bytes reach this far; beyond, the form called BigTIFF has eight.
_FAR: Final = (1 << 32) - 1
_ASCII, _SHORT, _LONG, _RATIONAL, _LONG8 = 2, 3, 4, 5, 16


def write(volume: Volume, path: Path) -> None:
    """Little endian; where the samples lie is in the description of the first picture."""
    values = volume.values.view(np.uint8) if volume.values.dtype == np.bool_ else volume.values
    if values.dtype.name not in _KINDS:
        raise FormatError(f"a TIFF here holds {', '.join(_KINDS)}, not {values.dtype}; write .nrrd or .npz")
    layers = values.T if values.ndim == 3 else values.T[None]
    size = layers[0].nbytes
    note = raw.note(volume).encode() + b"\0"
    pages = [_Page(layers.shape[2], layers.shape[1], values.dtype, volume, note if n == 0 else b"") for n in (0, 1)]
    total = 16 + len(layers) * (size + 512) + len(note)
    far = total > _FAR
    lengths = [page.length(far) for page in pages]
    with replacing(path) as stream:
        at = 16 if far else 8
        stream.write(struct.pack("<2sHHHQ", b"II", 43, 8, 0, at) if far else struct.pack("<2sHI", b"II", 42, at))
        for number, layer in enumerate(layers):
            page, length = pages[min(number, 1)], lengths[min(number, 1)]
            after = at + length + size + -size % 8
            last = number == len(layers) - 1
            stream.write(page.directory(at, length, size, 0 if last else after, far))
            raw.put(stream, layer.T)
            stream.write(b"\0" * (-size % 8))
            at = after


class _Page:
    """The directory of a picture: its tags, and what does not fit into them."""

    def __init__(self, width: int, height: int, dtype: np.dtype[np.generic], volume: Volume, note: bytes) -> None:
        steps = volume.spacing[:2] if volume.straight else (1.0, 1.0)
        # Pixels per unit, as near as fractions of this form come; the note is exact.
        ratios = [Fraction(1.0 / step).limit_denominator(1 << 20) for step in steps]
        fits = all(0 < ratio.numerator < 1 << 32 for ratio in ratios)
        ratios = ratios if fits else [Fraction(1), Fraction(1)]
        tags: list[tuple[int, int, int, bytes]] = [
            (256, _LONG, 1, struct.pack("<I", width)),
            (257, _LONG, 1, struct.pack("<I", height)),
            (258, _SHORT, 1, struct.pack("<H", 8 * dtype.itemsize)),
            (259, _SHORT, 1, struct.pack("<H", 1)),
            (262, _SHORT, 1, struct.pack("<H", 1)),
            (270, _ASCII, len(note), note),
            (273, _LONG8, 1, b""),
            (277, _SHORT, 1, struct.pack("<H", 1)),
            (278, _LONG, 1, struct.pack("<I", height)),
            (279, _LONG8, 1, b""),
            (282, _RATIONAL, 1, struct.pack("<2I", ratios[0].numerator, ratios[0].denominator)),
            (283, _RATIONAL, 1, struct.pack("<2I", ratios[1].numerator, ratios[1].denominator)),
            (296, _SHORT, 1, struct.pack("<H", 1)),
            (339, _SHORT, 1, struct.pack("<H", _KINDS[dtype.name])),
        ]
        self._tags = [tag for tag in tags if tag[0] != 270 or note]

    def length(self, far: bool) -> int:
        """Bytes of the directory and of what it points to, a multiple of 8."""
        entry, room = (20, 8) if far else (12, 4)
        outside = sum(-(-len(data) // 8) * 8 for _, _, _, data in self._tags if len(data) > room)
        size = (16 if far else 6) + entry * len(self._tags)
        return -(-size // 8) * 8 + outside

    def directory(self, at: int, length: int, size: int, after: int, far: bool) -> bytes:
        """The directory as it stands at `at`, the picture of `size` bytes after it, the next directory at `after`."""
        room = 8 if far else 4
        word = "<Q" if far else "<I"
        head = struct.pack("<Q" if far else "<H", len(self._tags))
        entries = b""
        outside = b""
        beyond = at + -(-((16 if far else 6) + (20 if far else 12) * len(self._tags)) // 8) * 8
        for tag, kind, count, given in self._tags:
            stored, data = kind, given
            if kind == _LONG8:
                stored = _LONG8 if far else _LONG
                data = struct.pack(word, at + length if tag == 273 else size)
            if len(data) > room:
                place = struct.pack(word, beyond + len(outside))
                outside += data + b"\0" * (-len(data) % 8)
                data = place
            entries += struct.pack("<HH" + word[1], tag, stored, count) + data.ljust(room, b"\0")
        start = head + entries + struct.pack(word, after)
        return start.ljust(beyond - at, b"\0") + outside
