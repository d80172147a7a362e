"""Shapes from formulas and from functions of your own: inside is where they are negative.

>>> from truefield import implicit
>>> x, y, z = implicit.axes()
>>> gyroid = implicit.field(
...     implicit.sin(x) * implicit.cos(y) + implicit.sin(y) * implicit.cos(z) + implicit.sin(z) * implicit.cos(x),
...     domain=((0, 0, 0), (6.2, 6.2, 6.2)),
... )

A formula's values are no distances: `field` finds the true distance to where it vanishes, with proof. A function
written in Python cannot be looked into: what `function` knows is how fast it changes.
"""

from __future__ import annotations

import math
import numbers
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truefield import _truefield, arguments
from truefield.arguments import Floats, Progress
from truefield.errors import TruefieldError
from truefield.shape import Shape

Number = float | np.floating | np.integer
Box = tuple[Sequence[float], Sequence[float]]


class Expression:
    """A formula of x, y and z, put together by `+ - * / **`, `abs` and the functions of this module; immutable.

    Numbers mix in. Equal parts are computed once, however often they are used.
    """

    __slots__ = ("_native",)

    # numpy's numbers leave arithmetic with an expression to the expression.
    __array_ufunc__ = None

    def __init__(self, native: _truefield.Expression) -> None:
        """For `axes` and the operators."""
        self._native = native

    def __add__(self, other: Expression | Number) -> Expression:
        """The sum."""
        return _binary("add", self, other)

    def __radd__(self, other: Number) -> Expression:
        """The sum."""
        return _binary("add", other, self)

    def __sub__(self, other: Expression | Number) -> Expression:
        """The difference."""
        return _binary("subtract", self, other)

    def __rsub__(self, other: Number) -> Expression:
        """The difference."""
        return _binary("subtract", other, self)

    def __mul__(self, other: Expression | Number) -> Expression:
        """The product."""
        return _binary("multiply", self, other)

    def __rmul__(self, other: Number) -> Expression:
        """The product."""
        return _binary("multiply", other, self)

    def __truediv__(self, other: Expression | Number) -> Expression:
        """The quotient."""
        return _binary("divide", self, other)

    def __rtruediv__(self, other: Number) -> Expression:
        """The quotient."""
        return _binary("divide", other, self)

    def __pow__(self, exponent: Expression | Number) -> Expression:
        """A power: whole exponents of any base, others of a base that is not negative."""
        if isinstance(exponent, Expression):
            return exp(exponent * log(self))
        power = float(exponent)
        if math.isfinite(power) and power == int(power):
            if abs(power) > 1000:
                raise TruefieldError(f"the exponent is {exponent}; give one between -1000 and 1000")
            return Expression(self._native.power(int(power)))
        if power == 0.5:
            return sqrt(self)
        return exp(log(self) * power)

    def __rpow__(self, base: Number) -> Expression:
        """A positive number to the power of this."""
        if not float(base) > 0:
            raise TruefieldError(f"the base is {base}; a power with an expression as exponent needs a positive one")
        return exp(self * math.log(base))

    def __neg__(self) -> Expression:
        """The negative."""
        return _unary("negative", self)

    def __pos__(self) -> Expression:
        """The same."""
        return self

    def __abs__(self) -> Expression:
        """The absolute value."""
        return _unary("absolute", self)

    def __bool__(self) -> bool:
        """An expression is neither true nor false."""
        raise TruefieldError(
            "an expression is neither true nor false; use implicit.minimum and implicit.maximum instead of comparisons"
        )


def axes() -> tuple[Expression, Expression, Expression]:
    """The coordinates x, y and z, to write formulas with."""
    x, y, z = _truefield.Expression.axes()
    return Expression(x), Expression(y), Expression(z)


def sin(of: Expression | Number) -> Expression:
    """The sine of an angle in radians."""
    return _unary("sin", of)


def cos(of: Expression | Number) -> Expression:
    """The cosine of an angle in radians."""
    return _unary("cos", of)


def tan(of: Expression | Number) -> Expression:
    """The tangent of an angle in radians."""
    return _unary("tan", of)


def arctan(of: Expression | Number) -> Expression:
    """The angle of a tangent, from -pi/2 to pi/2."""
    return _unary("arctan", of)


def arctan2(y: Expression | Number, x: Expression | Number) -> Expression:
    """The angle of the point (x, y), from -pi to pi."""
    return _binary("arctan2", y, x)


def exp(of: Expression | Number) -> Expression:
    """e to the power of an expression."""
    return _unary("exp", of)


def log(of: Expression | Number) -> Expression:
    """The natural logarithm, of what is positive."""
    return _unary("log", of)


def sqrt(of: Expression | Number) -> Expression:
    """The square root, of what is not negative."""
    return _unary("sqrt", of)


def square(of: Expression | Number) -> Expression:
    """An expression times itself."""
    return _unary("square", of)


def absolute(of: Expression | Number) -> Expression:
    """The absolute value."""
    return _unary("absolute", of)


def floor(of: Expression | Number) -> Expression:
    """The largest whole number that is not above."""
    return _unary("floor", of)


def minimum(first: Expression | Number, *others: Expression | Number) -> Expression:
    """The least of several expressions: the union of their shapes."""
    result = _expression(first)
    for other in others:
        result = _binary("minimum", result, other)
    return result


def maximum(first: Expression | Number, *others: Expression | Number) -> Expression:
    """The greatest of several expressions: what their shapes have in common."""
    result = _expression(first)
    for other in others:
        result = _binary("maximum", result, other)
    return result


def evaluate(
    expression: Expression | Number,
    points: ArrayLike,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Floats:
    """(n,) float64 values of a formula at points (n, 3); not a number where it is not defined there.

    Raises:
        TruefieldError: the expression has numbers in it that are not finite, or the points are not (n, 3).
    """
    return _expression(expression)._native.evaluate(arguments.vectors(points), threads, progress)


def field(
    expression: Expression, domain: Box | None = None, *, threads: int | None = None, progress: Progress | None = None
) -> Shape:
    """The solid where a formula is negative, within a box, with its true distance.

    Args:
        expression: a formula of `axes()`; its own values need not be distances.
        domain: lowest and highest corner; a formula needs one. The box bounds the solid: where the formula is negative
            on a face, the face is surface. The formula is not asked outside.
        threads: number of threads; all cores by default.
        progress: called as `progress(phase, fraction)`.

    Next to smooth surface, `bounds` are within 1e-10 of the domain's diagonal, and within 1e-6 where several places are
    nearly as far: a foot is found by Newton's method, that nothing is nearer is proven with intervals of second
    derivatives, that nothing is farther by a change of sign. At kinks (of `minimum`, `maximum`, `absolute`) they are
    within 2e-4 of the diagonal, and slow. A change of sign is surface, through zero or through a pole; zeros that the
    formula only touches, as squares do, are none. Where interval arithmetic cannot tell one from the other, `bounds`
    hold both: the lower one is the distance to where surface may be, the upper one that to where it is for certain,
    which may be infinite. To give such a zero set a thickness, subtract a positive number.

    From the middle of what is nearly a ball, all of it is as near: there `bounds` are cut off and wider, while
    `distance` goes on until it is as near as elsewhere, which took from half a second (the root of a sum of squares) to
    some ten seconds for a single point.

    Raises:
        TruefieldError: the domain is missing or no finite box, or the formula is nowhere negative in it; when asked,
            the formula is not defined at a point of the domain, or `distance` is not found to that accuracy, because
            too much of the surface is as near or rounding of the formula hides it.
    """
    if not isinstance(expression, Expression):
        raise TruefieldError(f"the expression is {expression!r}; make one from implicit.axes()")
    if domain is None:
        raise TruefieldError("a formula may have surface anywhere; give a domain, the two corners of a box")
    low, high = arguments.box("domain", domain)
    native = expression._native.shape(low, high, threads, progress)
    return Shape(native, f"implicit.field(..., domain=({_corner(low)}, {_corner(high)}))")


def function(
    compute: Callable[[Floats], NDArray[np.float64]],
    lipschitz: float = 1.0,
    domain: Box | None = None,
    *,
    values: str = "bound",
) -> Shape:
    """The solid where a function of yours is negative.

    Args:
        compute: takes points (n, 3) float64 and answers (n,) numbers. It is called on other threads.
        lipschitz: the function changes by no more than this times the way that one moves. Values are divided by it.
            Neighbours in the order of points that contradict it are an error.
        domain: lowest and highest corner of the box in which it may be asked, which also bounds the solid; without,
            it is asked anywhere and the solid has no extent.
        values: "bound": the distance is at least value / lipschitz, which is all that `bounds` promises. "distance":
            value / lipschitz is the distance, and the solid lies inside the domain.

    Raises:
        TruefieldError: the arguments make no sense; when asked, the function raised (the cause is its own exception),
            did not answer one number for each point, or changes faster than stated. A function that failed is not
            asked again.
    """
    if not callable(compute):
        raise TruefieldError(f"the function is {compute!r}; give something that can be called with points")
    native = _truefield.function_shape(
        compute,
        arguments.length("lipschitz", lipschitz),
        None if domain is None else arguments.box("domain", domain),
        values,
    )
    return Shape(native, f"implicit.function({getattr(compute, '__name__', 'compute')}, lipschitz={lipschitz:g})")


def _expression(value: Expression | Number) -> Expression:
    if isinstance(value, Expression):
        return value
    if isinstance(value, numbers.Real | np.floating | np.integer) and not isinstance(value, bool):
        return Expression(_truefield.Expression.constant(float(value)))
    raise TruefieldError(f"{value!r} is neither an expression nor a number")


def _unary(name: str, of: Expression | Number) -> Expression:
    return Expression(_expression(of)._native.unary(name))


def _binary(name: str, a: Expression | Number, b: Expression | Number) -> Expression:
    return Expression(_expression(a)._native.binary(name, _expression(b)._native))


def _corner(corner: Sequence[float]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in corner) + ")"
