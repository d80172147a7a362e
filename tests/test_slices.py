"""Pictures of slices and transforms: what they show is where it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import truefield as tf
from numpy.typing import NDArray
from PIL import Image
from solids import blob
from truefield import slices


@pytest.fixture(scope="module")
def surface() -> tf.Surface:
    return tf.Surface(blob())


def blue(image: Image.Image) -> NDArray[np.bool_]:
    """Pixels in the colours of the inside, which have more blue than red."""
    pixels = np.asarray(image).astype(int)
    return np.asarray(pixels[..., 2] - pixels[..., 0] > 25)


def test_every_kind_of_field_gives_the_same_slice(surface: tf.Surface, tmp_path: Path) -> None:
    fields: list[slices.Field] = [surface, tf.complete_field(surface, resolution=20)]
    first, second = (np.asarray(slices.slice_picture(field, "y", size=(400, 300))) for field in fields)
    np.testing.assert_array_equal(first, second)
    sampled = slices.slice_picture(surface.sample(resolution=60, margin=0.1), "x", 0.1, tmp_path / "a.png", lines=0.1)
    assert np.asarray(Image.open(tmp_path / "a.png")).shape == (900, 1200, 3)
    assert blue(sampled).any()


def test_inside_is_blue_where_it_is() -> None:
    """A disc off the middle: its pixels are where x runs to the right and y downward."""
    x, y = np.meshgrid(np.arange(90), np.arange(60), indexing="ij")
    distance = np.hypot(x - 20.0, y - 15.0) - 10.0
    image = slices.transform_picture(distance, size=(900, 700), lines=1000.0)
    across = np.argwhere(blue(image)[:, :750])
    height, width = across.max(axis=0) - across.min(axis=0) + 1
    # A circle, up to the line that is drawn on it.
    assert abs(height - width) <= 2
    frame = np.argwhere((np.asarray(image)[:, :750] != 255).any(axis=2) & (np.arange(700) > 120)[:, None])
    low, high = frame.min(axis=0), frame.max(axis=0)
    centre = (across.min(axis=0) + across.max(axis=0)) / 2
    np.testing.assert_allclose((centre - low) / (high - low), [15.5 / 60, 20.5 / 90], atol=0.02)


def test_lines_are_where_distances_are_round() -> None:
    x = np.broadcast_to(np.arange(400.0)[:, None], (400, 300)) - 100.0
    values = x.T
    ink = slices._ink(values, 1.0, 50.0, 20.0)
    assert np.all(ink[:, np.abs(x[:, 0] % 50.0 - 25.0) < 20] == 0)
    assert np.all(ink[:, x[:, 0] % 50.0 == 0] > 0.3)
    zero = ink[:, x[:, 0] == 0]
    assert np.all(zero > ink[:, x[:, 0] == 50].max())


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"axis": "w"}, "axis"),
        ({"size": (10, 10)}, "pixels"),
        ({"lines": 0.0}, "lines"),
        ({"lines": np.nan}, "lines"),
        ({"at": 1e9, "field": "sampled"}, "no distance"),
        ({"field": 3}, "int"),
    ],
)
def test_bad_slices_are_one_sentence(surface: tf.Surface, arguments: dict[str, object], named: str) -> None:
    field = arguments.pop("field", surface)
    asked = surface.sample(resolution=8) if field == "sampled" else field
    with pytest.raises(tf.TruefieldError, match=named):
        slices.slice_picture(asked, **arguments)  # type: ignore[arg-type]
    with pytest.raises(tf.TruefieldError, match="image"):
        slices.transform_picture(np.full((3, 3), np.inf))
