import numpy as np
import pytest
import truefield as tf
from truefield import patches


def places(count: int, size: float, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-size, size, (count, 3))


def flat(corner: list[float], u: list[float], v: list[float]) -> np.ndarray:
    steps = np.arange(4.0) / 3.0
    patch: np.ndarray = (
        np.array(corner)
        + steps[:, None, None] * np.array(u, dtype=float)
        + steps[None, :, None] * np.array(v, dtype=float)
    )
    return patch


def block() -> np.ndarray:
    x, y, z = ([2.0, 0, 0], [0, 2.0, 0], [0, 0, 2.0])
    low = [-1.0, -1.0, -1.0]
    return np.array(
        [
            flat(low, y, x),
            flat([-1, -1, 1], x, y),
            flat(low, x, z),
            flat([-1, 1, -1], z, x),
            flat(low, z, y),
            flat([1, -1, -1], y, z),
        ]
    )


def test_a_cube_of_patches_is_a_cube() -> None:
    p = places(400, 2.0)
    expected = tf.csg.box((2, 2, 2)).distance(p)
    shape = patches.surface(block())
    np.testing.assert_allclose(shape.distance(p), expected, atol=1e-10)
    lower, upper = shape.bounds(p)
    assert (upper - lower).max() < 1e-9
    assert ((lower <= expected + 1e-14) & (expected - 1e-14 <= upper)).all()
    open_box = patches.surface(block()[:5], sides="unsigned")
    assert (open_box.distance(p) >= 0).all()
    assert "5 patches" in repr(open_box)


def sampled(controls: np.ndarray, steps: int) -> np.ndarray:
    t = np.linspace(0, 1, steps)
    b = np.stack([(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3], axis=1)
    points: np.ndarray = np.einsum("ai,bj,nijk->nabk", b, b, controls).reshape(-1, 3)
    return points


def test_each_part_of_the_teapot_closes_up_and_is_as_far_as_its_samples() -> None:
    inside = [(0.0, 0.0, 1.0), (-2.42, 0.0, 1.9), (2.2, 0.0, 1.3)]
    for controls, middle in zip(patches.teapot_patches(), inside, strict=True):
        shape = patches.surface(controls)
        samples = sampled(controls, 40)
        p = places(60, 3.0, 1)
        nearest = np.sqrt(((p[:, None] - samples) ** 2).sum(axis=2).min(axis=1))
        distance = shape.distance(p)
        assert (np.abs(distance) <= nearest + 1e-9).all()
        assert (np.abs(distance) >= nearest - 0.1).all()
        assert shape.distance([middle])[0] < -0.05
        assert shape.distance([(4.0, 4.0, 4.0)])[0] > 0
        low, high = shape.extent or (None, None)
        assert low is not None
        assert ((low <= samples.min(axis=0)) & (samples.max(axis=0) <= high)).all()


def test_the_teapot_is_one_solid() -> None:
    teapot = patches.teapot()
    # The body, the handle, the hole of the handle, the spout, beside it all.
    p = [(0.0, 0.0, 1.0), (-2.42, 0.0, 1.9), (-2.1, 0.0, 1.4), (2.2, 0.0, 1.3), (2.2, 1.5, 1.3)]
    assert (np.sign(teapot.distance(p)) == [-1, -1, 1, -1, 1]).all()
    lower, upper = teapot.bounds(places(100, 3.0))
    assert (lower <= upper).all()


@pytest.mark.parametrize(
    ("controls", "words"),
    [
        (3, "shape"),
        ("teapot", "not numbers"),
        (np.zeros((2, 4, 4)), "shape"),
        (np.zeros((0, 4, 4, 3)), "no patches"),
        (np.full((1, 4, 4, 3), np.nan), "finite"),
        (block()[:5], "unsigned"),
    ],
)
def test_wrong_patches_are_a_sentence(controls: object, words: str) -> None:
    with pytest.raises(tf.TruefieldError, match=words):
        patches.surface(controls)  # type: ignore[arg-type]
    with pytest.raises(tf.TruefieldError, match="sides"):
        patches.surface(block(), sides="open")  # type: ignore[arg-type]
