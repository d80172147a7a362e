"""TIFF, a picture for each z, and PNG: read through pillow, which knows the world's files; PNG is written by it too."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from truefield import arguments
from truefield.errors import FileError
from truefield.files import replacing
from truefield.formats.polygons import FormatError
from truefield.formats.volumes import raw

if TYPE_CHECKING:
    from PIL import Image

    from truefield.volume import Volume

_MODES: Final = {
    "1": np.uint8,
    "L": np.uint8,
    "I;16": np.uint16,
    "I;16L": np.uint16,
    "I;16B": np.uint16,
    "I": np.int32,
    "F": np.float32,
}
_PNG: Final = ("uint8", "uint16")
# The most that deflate, and what is before it, make of a byte.
_MOST_PACKED: Final = 8192
_DESCRIPTION, _X_RESOLUTION, _Y_RESOLUTION = 270, 282, 283
_BITS, _FORMAT = 258, 339


def read(path: Path) -> Volume:
    """One picture: an image (x, y); several: a volume (x, y, z). Spacing from our own note, or as ImageJ writes it.

    A picture of one bit gives booleans. Colours are refused, and so are samples that pillow would round.
    """
    from PIL import Image, UnidentifiedImageError

    from truefield.volume import Volume

    try:
        # The limit is for pictures from strangers' pages; here the file is the user's, and its size is checked.
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        with warnings.catch_warnings():
            # Of tags that nobody needs here.
            warnings.simplefilter("ignore")
            with Image.open(path, formats=("TIFF", "PNG")) as picture:
                pages = getattr(picture, "n_frames", 1)
                stack = _stack(picture, pages, path.stat().st_size)
                place = _place(picture, 2 if pages == 1 else 3)
    except FileError:
        raise
    except UnidentifiedImageError:
        raise FormatError("it is no TIFF or PNG picture; save it again") from None
    except FormatError:
        raise
    except Exception as error:  # what pillow raises of damaged pictures has no common base
        raise FormatError(f"its picture is damaged ({' '.join(str(error).split())}); copy it again") from None
    finally:
        Image.MAX_IMAGE_PIXELS = limit
    return Volume(stack.T if pages > 1 else stack[0].T, name=raw.stem(path), **place)


def write_png(volume: Volume, path: Path) -> None:
    """Where the samples lie is in a text beside them."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    if volume.values.ndim != 2:
        raise FormatError("a PNG holds one image; write a volume as .tif, .nrrd, .nii, .vti or .npz")
    values = volume.values.view(np.uint8) if volume.values.dtype == np.bool_ else volume.values
    if values.dtype.name not in _PNG:
        raise FormatError(f"a PNG holds {' or '.join(_PNG)}, not {values.dtype}; write .tif, .nrrd or .npz")
    picture = Image.fromarray(np.ascontiguousarray(values.T))
    info = PngInfo()
    if not raw.is_plain(volume):
        info.add_text("Description", raw.note(volume))
    with replacing(path) as stream:
        picture.save(stream, "PNG", pnginfo=info)


def _stack(picture: Image.Image, pages: int, size: int) -> NDArray[Any]:
    """(z, y, x) all pictures, of one size and kind."""
    stack: NDArray[Any] | None = None
    for page in range(pages):
        picture.seek(page)
        mode, (width, height) = picture.mode, picture.size
        if mode not in _MODES:
            kind = {"P": "a palette", "LA": "transparency"}.get(mode, "colours")
            raise FormatError(f"its picture has {kind} ({mode}); turn it into shades of grey")
        _check_kept(picture)
        # Fax codes pack a blank page of one bit into next to nothing.
        most = size * (_MOST_PACKED if mode != "1" else _MOST_PACKED**2)
        _check_size(width * height * pages * np.dtype(_MODES[mode]).itemsize, most)
        samples = np.asarray(picture)
        if mode == "1":
            samples = samples.astype(np.bool_)
        elif samples.dtype != _MODES[mode]:
            samples = samples.astype(_MODES[mode])
        if stack is None:
            stack = np.empty((pages, height, width), samples.dtype)
        if samples.shape != stack.shape[1:] or samples.dtype != stack.dtype:
            raise FormatError(f"picture {page + 1} has another size or type than the first; save one volume in a file")
        stack[page] = samples
    if stack is None:
        raise FormatError("it holds no picture")
    return stack


def _check_size(needed: int, most: int) -> None:
    """Refuses pictures that the file cannot hold, or the machine, before they are made."""
    if needed > most:
        raise FormatError(
            f"its pictures would take {needed} bytes, more than a file of its size can hold; copy it again"
        )
    if needed > arguments.memory(None):
        raise FormatError(f"its pictures take {needed} bytes, more than half the memory; cut out a part of it")


def _check_kept(picture: Image.Image) -> None:
    """Refuses samples that pillow reads into a type that holds less."""
    tags = getattr(picture, "tag_v2", None)
    if tags is None:
        return
    bits, kind = tags.get(_BITS, (1,)), tags.get(_FORMAT, (1,))
    bits, kind = (value[0] if isinstance(value, tuple) else value for value in (bits, kind))
    signed_small = kind == 2 and bits in (8, 16)
    if bits > 32 or signed_small or (kind == 1 and bits == 32):
        names = {1: "unsigned integers", 2: "signed integers", 3: "floats"}
        raise FormatError(f"its samples are {names.get(kind, 'numbers')} of {bits} bit; save it as .nrrd or as float32")


def _place(picture: Image.Image, axes: int) -> dict[str, Any]:
    tags = getattr(picture, "tag_v2", None)
    if tags is None:
        return raw.noted(str(picture.info.get("Description", "")), axes) or {}
    picture.seek(0)
    tags = picture.tag_v2  # type: ignore[attr-defined]
    text = str(tags.get(_DESCRIPTION, ""))
    noted = raw.noted(text, axes)
    if noted is not None:
        return noted
    if not text.startswith("ImageJ="):
        return {}
    # ImageJ: pixels per unit, and the way between pictures in a line of its own.
    steps = [
        1.0 / float(tags.get(tag, 1)) if float(tags.get(tag, 1)) > 0 else 1.0 for tag in (_X_RESOLUTION, _Y_RESOLUTION)
    ]
    between = re.search(r"^spacing=([-+.\deE]+)$", text, re.MULTILINE)
    try:
        steps.append(abs(float(between[1])) or 1.0 if between else 1.0)
    except ValueError:
        steps.append(1.0)
    return {"spacing": steps[:axes]}
