"""Interval enclosures hold the exact values: rational arithmetic and mpmath as the judges."""

from __future__ import annotations

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from armangle import _core

ADD, SUBTRACT, MULTIPLY, DIVIDE, SQRT, SIN, COS, HYPOT, SQUARE, ABS, MIN, MAX = range(12)
COUNT = 4000


def enclosures(operation: int, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the core's result of an interval operation for each row."""
    out = np.empty_like(a)
    _core.interval_many(operation, np.ascontiguousarray(a), np.ascontiguousarray(b), out)
    return out


def samples(seed: int, *, points: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Intervals (n, 2) of all sizes and signs, some with an end at zero (without width if `points`), and one
    member of each.
    """
    rng = np.random.default_rng(seed)
    ends = rng.normal(size=(COUNT, 2)) * 10.0 ** rng.integers(-12, 6, (COUNT, 1))
    ends[::17, 0] = 0.0
    ends[::19] *= 1e-160
    ends = np.sort(ends, axis=1)
    if points:
        ends[:, 1] = ends[:, 0]
    inside = ends[:, 0] + rng.uniform(0, 1, COUNT) * (ends[:, 1] - ends[:, 0])
    return ends, np.clip(inside, ends[:, 0], ends[:, 1])


@pytest.mark.turns(2)
@pytest.mark.slow
@pytest.mark.parametrize("points", [False, True])
@pytest.mark.parametrize("operation", [ADD, SUBTRACT, MULTIPLY, DIVIDE, SQUARE, ABS, MIN, MAX])
def test_arithmetic_encloses_rational_values(operation: int, points: bool) -> None:
    """Interval arithmetic encloses exact rational values; division by 0 is unbounded."""
    a, x = samples(1, points=points)
    b, y = samples(2, points=points)
    for (low, high), p, q, divisor in zip(enclosures(operation, a, b), x, y, b, strict=True):
        if operation == DIVIDE and divisor[0] <= 0 <= divisor[1]:
            assert (low, high) == (-np.inf, np.inf)
            continue
        u, v = Fraction(p), Fraction(q)
        exact = [u + v, u - v, u * v, u / v if v else u, u, u, u, u, u * u, abs(u), min(u, v), max(u, v)]
        assert Fraction(low) <= exact[operation] <= Fraction(high)


def test_a_point_is_enclosed_within_six_units_in_the_last_place() -> None:
    """Interval sums, products and quotients of points are at most six units in the last place wide."""
    a, _ = samples(3, points=True)
    b, _ = samples(4, points=True)
    big = (np.abs(a[:, 0]) > 1e-100) & (np.abs(b[:, 0]) > 1e-100)
    for operation in (ADD, MULTIPLY, DIVIDE):
        width = np.ptp(enclosures(operation, a[big], b[big]), axis=1)
        size = np.abs(enclosures(operation, a[big], b[big])).max(axis=1)
        assert (width <= 6 * np.spacing(size)).all()


@pytest.mark.parametrize("operation", [SQRT, HYPOT])
def test_roots_enclose_values_of_fifty_digits(operation: int) -> None:
    """Interval sqrt and hypot enclose values of 50 digits."""
    a, x = samples(5)
    b, y = samples(6)
    if operation == SQRT:
        a, x = np.sort(np.abs(a), axis=1), np.abs(x)
        x = np.clip(x, a[:, 0], a[:, 1])
    with mpmath.workdps(50):
        for (low, high), p, q in zip(enclosures(operation, a, b), x, y, strict=True):
            u, v = mpmath.mpf(p), mpmath.mpf(q)
            exact = mpmath.sqrt(u) if operation == SQRT else mpmath.sqrt(u * u + v * v)
            assert mpmath.mpf(low) <= exact <= mpmath.mpf(high)


@pytest.mark.turns(2)
@pytest.mark.parametrize(("operation", "name"), [(SIN, "sin"), (COS, "cos")])
@pytest.mark.parametrize("width", [0.0, 1e-9, 0.3, 0.99, 3.0])
def test_sine_and_cosine_enclose_values_of_fifty_digits(operation: int, name: str, width: float) -> None:
    """Interval sine and cosine enclose values of 50 digits, at extremes too."""
    rng = np.random.default_rng(int(100 * width) + operation)
    low = rng.uniform(-900, 900, COUNT)
    half = COUNT // 2
    low[:half] = np.round(low[:half] / (np.pi / 2)) * (np.pi / 2) - rng.uniform(0, 1, half) * width
    a = np.stack([low, low + width], axis=1)
    x = np.clip(low + rng.uniform(0, 1, COUNT) * width, a[:, 0], a[:, 1])
    x[::3], x[1::3] = a[::3, 0], a[1::3, 1]
    middle = np.round(x / (np.pi / 2)) * (np.pi / 2)  # where an extreme lies in the interval: its value there
    x = np.where((middle >= a[:, 0]) & (middle <= a[:, 1]) & (np.arange(COUNT) % 2 == 0), middle, x)
    out = enclosures(operation, a, a)
    with mpmath.workdps(50):
        for (lower, upper), p in zip(out, x, strict=True):
            assert mpmath.mpf(lower) <= getattr(mpmath, name)(mpmath.mpf(p)) <= mpmath.mpf(upper)
    if width < 1e-8:
        assert (np.ptp(out, axis=1) <= np.ptp(a, axis=1) + 3e-15).all()


def test_far_away_or_wide_the_sine_is_anything() -> None:
    """The interval sine of arguments that are far, wide or undefined is [-1, 1]."""
    far = np.array([[1e4, 1e4], [0.0, 7.0], [-np.inf, np.inf], [np.nan, 1.0]])
    assert (enclosures(SIN, far, far) == [-1.0, 1.0]).all()


@pytest.mark.parametrize("operation", [MULTIPLY, DIVIDE, SQRT, HYPOT, MIN, MAX])
def test_nothing_is_concluded_from_the_unbounded_or_undefined(operation: int) -> None:
    """Intervals that are unbounded or NaN give results that exclude nothing."""
    bad = np.array([[-np.inf, np.inf], [np.nan, np.nan], [1.0, np.nan], [0.0, np.inf]])
    fine = np.ones_like(bad)
    for a, b in ((bad, fine), (fine, bad)) if operation != SQRT else ((bad, bad),):
        low, high = enclosures(operation, a, b).T
        assert not (low > 0.5).any()
        assert not (high < 0.5).any()
