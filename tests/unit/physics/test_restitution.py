"""The impact within a step, against the parabola of a ball that bounces."""

import math

import pytest

from verlet_numba.physics.restitution import impact

G, E = -9.81, 0.6


def gap_of_a_ball(height, speed, t, e=E):
    """Gap at time t of a ball that starts at `height` with `speed` upwards and bounces once, and its velocity then."""
    s = (speed + math.sqrt(speed**2 - 2 * G * height)) / -G
    if t <= s:
        return height + speed * t + G * t**2 / 2, speed + G * t
    leave = -e * (speed + G * s)
    return leave * (t - s) + G * (t - s)**2 / 2, leave + G * (t - s)


@pytest.mark.parametrize(("height", "speed"), [(0.01, -2.0), (0.001, -5.0), (0.02, -2.5), (0.0, -1.0), (0.049, -5.0)])
def test_impact_follows_the_parabola_from_the_hit_on(height, speed):
    h = 0.01
    after = height + speed * h + G * h * h / 2
    assert after < 0
    gap, displacement = impact(height, after, G, h, E)
    exact, velocity = gap_of_a_ball(height, speed, h)
    assert gap == pytest.approx(exact, abs=1e-14)
    assert displacement == pytest.approx(velocity * h - G * h * h / 2, abs=1e-14)     # x(t) - x(t-h) on the parabola
    following = gap + displacement + G * h * h
    assert following == pytest.approx(gap_of_a_ball(height, speed, 2 * h)[0], abs=1e-13)


def test_no_acceleration_reverses_the_velocity():
    gap, displacement = impact(0.01, -0.03, 0.0, 0.01, 1.0)
    assert gap == pytest.approx(0.03)
    assert displacement == pytest.approx(0.04)
    assert impact(0.0, -0.02, 0.0, 0.01, 0.5) == pytest.approx((0.01, 0.01))


def test_elastic_impact_keeps_the_energy():
    h, height, speed = 0.01, 0.004, -1.7
    gap, displacement = impact(height, height + speed * h + G * h * h / 2, G, h, 1.0)
    velocity = displacement / h + G * h / 2
    assert velocity**2 / 2 - G * gap == pytest.approx(speed**2 / 2 - G * height)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_flight_shorter_than_a_step_is_rest(share):
    """The flight after the hit lasts 2 leave / g."""
    h = 0.01
    speed = -share * (-G * h / 2) / E
    gap, displacement = impact(0.0, speed * h + G * h * h / 2, G, h, E)
    assert (displacement > 0) == (share > 1)
    assert gap == pytest.approx(max(0.0, -E * speed * h + G * h * h / 2), abs=1e-15)


def test_nothing_is_given_back_without_restitution():
    assert impact(0.01, -0.02, G, 0.01, 0.0) == (0, 0)


def test_pressed_from_the_surface_stays():
    """Started on the surface at rest, pushed in by gravity alone."""
    h = 0.01
    assert impact(0.0, G * h * h / 2, G, h, 1.0) == (0, 0)
