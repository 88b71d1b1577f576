"""Time of impact: no impact is missed or told too late, checked in exact arithmetic, degenerate features included."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from verlet_numba.kernels.impact_time import NEVER, apart_at, time_of_impact

BITS = 2.0**-10
whole = st.integers(-1024, 1024)
points = st.lists(st.tuples(whole, whole, whole), min_size=4, max_size=4)
parts = st.lists(st.integers(0, 16), min_size=4, max_size=4)
ways = ("any", "flat", "equal", "line", "still", "tiny")


def met(where, steps, share, edges, when, way):
    """Start and end (4, 3), exact in double precision, of features that touch in one point at the time when / 16.

    where: corners at that time, the first of the second feature moved so that both have a point in common.
    """
    at = np.array(where, float) * BITS
    move = np.array(steps, float) * BITS
    if way == "flat":
        at[:, 2] = move[:, 2] = 0
    elif way == "equal":
        at[3] = at[2]
    elif way == "line":
        at[1:] = at[1] + np.array([[0], [1], [3]]) * (at[2] - at[1])
    elif way == "still":
        move[1:] = 0
    elif way == "tiny":
        at, move = at * 2.0**-60, move * 2.0**-20
    p = np.array(share, float)
    if edges:
        u, v = p[0] / 16, p[1] / 16
        weight = np.array([1 - u, u, v - 1, -v])
    else:
        u, v = p[0] / 16, (1 - p[0] / 16) * p[1] / 16
        weight = np.array([1, u + v - 1, -u, -v])
    across = [sum(Fraction(w) * Fraction(x) for w, x in zip(weight, column, strict=True)) for column in at.T]
    first = [0, 1] if edges else [0]
    at[first] -= np.array([float(x) for x in across])
    t = when / 16
    start, now = at - t * move, at + (1 - t) * move
    exact = all(sum(Fraction(w) * (Fraction(x) + Fraction(t) * (Fraction(y) - Fraction(x))) for w, x, y in
                    zip(weight, s, n, strict=True)) == 0 for s, n in zip(start.T, now.T, strict=True))
    return start, now, exact


@pytest.mark.parametrize("way", ways)
@pytest.mark.parametrize("edges", [0, 1])
@settings(max_examples=150, deadline=None)
@given(points, points, parts, st.integers(0, 16))
def test_no_impact_is_missed(way, edges, where, steps, share, when):
    """What touches at a time known exactly (in fractions) is told, and not later."""
    start, now, exact = met(where, steps, share, edges, when, way)
    if not exact:           # it took more than 53 bits
        return
    assert time_of_impact(start, now, 0, 1, 2, 3, edges, 0.0) <= when / 16


@pytest.mark.parametrize("edges", [0, 1])
@settings(max_examples=150, deadline=None)
@given(points, points, st.integers(0, 200))
def test_up_to_it_features_are_apart(edges, where, steps, reach):
    """At every moment before it, by more than the reach; and where it is none, in all of the step."""
    start, now = np.array(where, float) * BITS, np.array(where, float) * BITS + np.array(steps, float) * BITS
    near = reach * BITS
    t = time_of_impact(start, now, 0, 1, 2, 3, edges, near)
    assert 0.0 <= t < 1.0 or t == NEVER
    for s in np.linspace(0, min(t, 1.0), 50) if t > 0 else ():
        assert apart_at(s, start, now, 0, 1, 2, 3, edges)[7] > near


@pytest.mark.parametrize(("place", "size"), [((0, 0, 0), 1.0), ((1e7, -1e7, 1e7), 1.0), ((0, 0, 0), 1e-6), ((0, 0, 0), 1e6)])
def test_bullet_through_paper(place, size):
    """A vertex that flies a thousand times the size of a triangle hits it, or misses it by a hair."""
    paper = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) - np.array([0.3, 0.3, 0])
    for x, hit in ((0.0, True), (0.39, True), (-0.29, True), (0.42, False), (-0.32, False)):
        start = np.concatenate([[[x, 0, 400]], paper]) * size + np.array(place)
        now = start + np.array([[0, 0, -1000 * size], [0, 0, 0], [0, 0, 0], [0, 0, 0]])
        t = time_of_impact(start, now, 0, 1, 2, 3, 0, 0.001 * size)
        assert (0.399 < t < 0.4) if hit else (t == NEVER), (x, t)


def test_the_same_anywhere():
    """Shifted by a power of two the time is the same to the bit."""
    rng = np.random.default_rng(0)
    for edges in (0, 1):
        for _ in range(50):
            start = np.round(rng.uniform(-1, 1, (4, 3)) * 1024) / 1024
            now = start + np.round(rng.uniform(-1, 1, (4, 3)) * 1024) / 1024
            assert time_of_impact(start, now, 0, 1, 2, 3, edges, 0.01) == time_of_impact(
                start + 4096, now + 4096, 0, 1, 2, 3, edges, 0.01)
