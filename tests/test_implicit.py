import threading
from collections.abc import Callable

import numpy as np
import pytest
import truefield as tf
from numpy.typing import NDArray
from truefield import csg, implicit

BOX = ((-1.5, -1.5, -1.5), (1.5, 1.5, 1.5))


def places(count: int, size: float = 1.5, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-size, size, (count, 3))


def ball() -> implicit.Expression:
    x, y, z = implicit.axes()
    return x * x + y**2 + implicit.square(z) - 1


def test_expressions_compute_what_numpy_does() -> None:
    x, y, z = implicit.axes()
    p = places(500)
    a, b, c = p.T
    cases = [
        (x + 2 * y - z / 3 + np.float64(1), a + 2 * b - c / 3 + 1),
        (np.float32(0.5) * x - np.int64(2), 0.5 * a - 2),
        (1 - x, 1 - a),
        (1 / (x + 3), 1 / (a + 3)),
        (-x + +y, -a + b),
        (abs(x) * implicit.absolute(y), abs(a) * abs(b)),
        (x**3 + y**-2 + z**0, a**3 + b**-2.0 + 1),
        ((x + 2) ** 0.5 + (x + 2) ** 1.5, (a + 2) ** 0.5 + (a + 2) ** 1.5),
        ((x + 2) ** y + 2**x, (a + 2) ** b + 2**a),
        (implicit.sin(x) + implicit.cos(y) + implicit.tan(z / 4), np.sin(a) + np.cos(b) + np.tan(c / 4)),
        (implicit.exp(x) + implicit.log(y + 2) + implicit.sqrt(z + 2), np.exp(a) + np.log(b + 2) + np.sqrt(c + 2)),
        (implicit.arctan2(x, y) + implicit.arctan(z), np.arctan2(a, b) + np.arctan(c)),
        (implicit.minimum(x, y, 0.2) + implicit.maximum(z, 0), np.minimum(np.minimum(a, b), 0.2) + np.maximum(c, 0)),
        (implicit.floor(3 * x), np.floor(3 * a)),
    ]
    for expression, expected in cases:
        np.testing.assert_allclose(implicit.evaluate(expression, p), expected, rtol=1e-12, atol=1e-13)


def test_a_formula_has_its_true_distance() -> None:
    shape = implicit.field(ball(), domain=BOX)
    p = places(2000, 3.0)
    truth = np.linalg.norm(p, axis=1) - 1
    lower, upper = shape.bounds(p)
    assert (lower <= truth + 1e-13).all()
    assert (truth - 1e-13 <= upper).all()
    assert (upper - lower).max() < 1e-8
    np.testing.assert_allclose(shape.distance(p), truth, atol=1e-9)
    np.testing.assert_allclose(shape.gradient(p), p / np.linalg.norm(p, axis=1)[:, None], atol=1e-6)
    assert "implicit.field" in repr(shape)


def test_the_domain_closes_the_solid() -> None:
    x, _, _ = implicit.axes()
    half = implicit.field(x + 0.0, domain=((-1, -1, -1), (1, 1, 1)))
    box = csg.box((1, 2, 2), center=(-0.5, 0, 0))
    p = places(500, 2.0)
    np.testing.assert_allclose(half.distance(p), box.distance(p), atol=1e-9)


@pytest.mark.parametrize(
    "domain", [None, 3, "box", ((0, 0), (1, 1)), ((0, 0, 0), (1, 1, np.inf)), ((1, 1, 1), (0, 0, 0))]
)
def test_a_formula_without_a_bounded_domain_is_refused(domain: object) -> None:
    with pytest.raises(tf.TruefieldError, match="domain"):
        implicit.field(ball(), domain=domain)  # type: ignore[arg-type]


def test_wrong_expressions_are_refused() -> None:
    x, _, _ = implicit.axes()
    with pytest.raises(tf.TruefieldError, match="positive"):
        implicit.field(ball() + 10, domain=BOX)
    with pytest.raises(tf.TruefieldError, match="finite"):
        implicit.field(x * float("nan"), domain=BOX)
    with pytest.raises(tf.TruefieldError, match="neither an expression nor a number"):
        x + "y"  # type: ignore[operator]
    with pytest.raises(tf.TruefieldError, match="neither true nor false"):
        bool(x)
    with pytest.raises(tf.TruefieldError, match=r"implicit\.axes"):
        implicit.field(3, domain=BOX)  # type: ignore[arg-type]
    with pytest.raises(tf.TruefieldError, match="not a number"):
        implicit.field(implicit.log(x), domain=BOX).distance([(-1, 0, 0)])
    with pytest.raises(tf.TruefieldError, match="give a domain"):
        implicit.field(ball())


def distance_of_a_ball(p: np.ndarray) -> np.ndarray:
    distance: np.ndarray = np.linalg.norm(p, axis=1) - 1
    return distance


def test_a_function_is_asked_in_numpy() -> None:
    p = places(3000)
    truth = distance_of_a_ball(p)
    exact = implicit.function(distance_of_a_ball, domain=BOX, values="distance")
    lower, upper = exact.bounds(p)
    np.testing.assert_array_equal(lower, truth)
    np.testing.assert_array_equal(upper, truth)
    bound = implicit.function(lambda p: 2 * distance_of_a_ball(p), lipschitz=2.5, domain=BOX)
    np.testing.assert_allclose(bound.distance(p), 0.8 * truth)
    lower, upper = bound.bounds(p)
    assert (lower <= truth).all()
    assert (truth <= upper).all()
    anywhere = implicit.function(distance_of_a_ball, values="distance")
    assert anywhere.extent is None
    np.testing.assert_array_equal(anywhere.distance(10 * p), distance_of_a_ball(10 * p))
    # Outside the domain a function is not asked, and what is said there holds.
    outside = implicit.function(distance_of_a_ball, domain=BOX, values="distance")
    lower, upper = outside.bounds(4 * p)
    far = distance_of_a_ball(4 * p)
    assert (lower <= far + 1e-12).all()
    assert (far <= upper + 1e-12).all()


def test_an_exception_reaches_the_user_with_its_cause() -> None:
    def broken(_: np.ndarray) -> np.ndarray:
        raise KeyError("no such part")

    shape = implicit.function(broken, domain=BOX)
    for _ in range(2):
        with pytest.raises(tf.TruefieldError, match=r"KeyError.*no such part") as caught:
            shape.distance(places(10))
        assert isinstance(caught.value.__cause__, KeyError)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (lambda p: p, r"shape \[10, 3\]"),
        (lambda _: 1.0, "shape"),
        (lambda p: p[:-1, 0], "shape"),
        (lambda p: np.where(p[:, 0] > 0, np.nan, 1.0), "not a number"),
        (lambda _: None, "TypeError|shape|not a number"),
        (lambda p: ["a"] * len(p), "ValueError"),
        (lambda p: 3 * distance_of_a_ball(p), "lipschitz"),
        (lambda: 1, "TypeError"),
    ],
)
def test_functions_that_misbehave_are_a_sentence(function: object, words: str) -> None:
    with pytest.raises(tf.TruefieldError, match=words):
        implicit.function(function, domain=BOX).distance(places(10))  # type: ignore[arg-type]


def test_a_shape_that_reaches_out_of_its_domain_is_found_out() -> None:
    shape = implicit.function(distance_of_a_ball, domain=((0, 0, 0), (1, 1, 1)), values="distance")
    with pytest.raises(tf.TruefieldError, match="domain"):
        shape.distance([(-1.0, 0.0, 0.0)])


def test_arguments_of_functions_are_checked() -> None:
    for arguments in ({"lipschitz": 0}, {"lipschitz": float("nan")}, {"values": "exact"}, {"domain": 3}):
        with pytest.raises(tf.TruefieldError):
            implicit.function(distance_of_a_ball, **arguments)
    with pytest.raises(tf.TruefieldError, match="called"):
        implicit.function(3)  # type: ignore[arg-type]


def test_functions_are_asked_from_many_threads_without_a_deadlock() -> None:
    shape = implicit.function(distance_of_a_ball, domain=BOX, values="distance")
    p = places(20_000)
    results: list[np.ndarray] = []
    threads = [threading.Thread(target=lambda: results.append(shape.distance(p, threads=3))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
        assert not thread.is_alive()
    assert len(results) == 4
    for result in results:
        np.testing.assert_array_equal(result, distance_of_a_ball(p))


def test_what_a_function_raises_is_heard_wherever_it_is_asked() -> None:
    box = ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))

    def fails(points: NDArray[np.float64]) -> NDArray[np.float64]:
        raise ZeroDivisionError(len(points))

    def says(answer: Callable[[int], NDArray[np.float64]]) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
        return lambda points: answer(len(points))

    for compute in (fails, says(lambda n: np.full(n, np.nan)), says(lambda n: np.zeros((n, 1)))):
        shape = implicit.function(compute, lipschitz=1.0, domain=box)
        for one in (shape, shape - csg.sphere(0.5)):
            points = [(1.0, 1.0, 1.0), (0.1, 0.2, 0.3)]
            for ask in (one.distance, one.bounds, one.gradient):
                with pytest.raises(tf.TruefieldError, match="the function"):
                    ask(points)
            with pytest.raises(tf.TruefieldError, match="the function"):
                tf.collide(one, csg.sphere(1.0))


@pytest.mark.parametrize("job", ["field", "distance", "bounds", "gradient"])
def test_ctrl_c_between_calls_of_a_function(job: str) -> None:
    import _thread
    import signal
    import time

    rang: list[bool] = []
    after = 0

    def slow(points: NDArray[np.float64]) -> NDArray[np.float64]:
        nonlocal after
        # As a function that ends soon after; the exception is raised where the job was started.
        after += bool(rang)
        time.sleep(0.005)
        values: NDArray[np.float64] = np.linalg.norm(points, axis=1) - 1.0 + 0.1 * np.sin(5.0 * points[:, 0])
        return values

    shape = implicit.function(slow, lipschitz=2.0, domain=((-2, -2, -2), (2, 2, 2)))
    points = np.random.default_rng(1).uniform(-2.0, 2.0, (200_000, 3))

    def ring() -> None:
        rang.append(True)
        _thread.interrupt_main()

    def work() -> None:
        while time.monotonic() < end:
            if job == "field":
                tf.adaptive_field(shape, 1e-7, memory=1 << 40)
            else:
                getattr(shape, job)(points)

    # Whoever runs tests in the background may have it ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    end = time.monotonic() + 60.0
    timer = threading.Timer(0.2, ring)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        work()
    timer.join()
    signal.signal(signal.SIGINT, before)
    # Half a second of calls.
    assert after < 100
