"""`gradient: step_start`: second order where the present direction is first, against closed forms and integrated equations."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ellipk

from verlet_numba.scene import shapes

G = 9.81
START = {"solver.gradient": "step_start"}
HALVINGS = 2 ** np.arange(7)
SIDE = 0.4


def scene(body, substeps, duration, gravity=True, **solver):
    """A scene at 60 frames a second."""
    return {"version": 1, "time": {"duration": duration, "frame_rate": 60}, "bodies": [body],
            "solver": {"substeps": substeps, "gradient": "step_start", **solver},
            "effects": {"contact": "none"} | ({"gravity": [0, 0, -G]} if gravity else {})}


def pendulum(degrees, substeps, duration):
    """Let go at rest at an angle from the bottom."""
    angle = np.radians(degrees)
    return scene({"kind": "particles", "name": "pendulum", "positions": [[0, 0, 0], [np.sin(angle), 0, -np.cos(angle)]],
                  "masses": [1, 1], "sticks": [[0, 1, 1]], "pinned": [0]}, substeps, duration)


def passages(time, x, v):
    """Times of x = 0 on the cubics through all frames."""
    return CubicHermiteSpline(time, x, v).roots(extrapolate=False)


def slopes(errors):
    """Order from each step to its half."""
    return np.log2(np.array(errors[:-1]) / errors[1:])


@pytest.mark.parametrize(("degrees", "reference"), [(90, 2.3678419), (150, 3.5350982), (175, 5.7727849)])
def test_period_of_a_pendulum(simulate, degrees, reference):
    closed = 4 * np.sqrt(1 / G) * ellipk(np.sin(np.radians(degrees) / 2)**2)
    assert closed == pytest.approx(reference, abs=1e-7)
    run = simulate(pendulum(degrees, 4, 2 * closed))
    times = passages(run.time, run.position[:, 1, 0], run.velocity[:, 1, 0])
    assert times[2] - times[0] == pytest.approx(closed, rel=5e-5)
    energy = run.measures["total_energy"]
    assert np.ptp(energy) < 2e-3 * G


def test_conical_pendulum(simulate):
    closed = 2 * np.pi * np.sqrt(np.cos(np.radians(60)) / G)
    run = simulate(Path("validation/conical_pendulum.yaml"), START | {"solver.substeps": 4})
    turned = np.unwrap(np.arctan2(run.position[:, 1, 1], run.position[:, 1, 0]))
    assert np.interp(2 * np.pi, turned, run.time) == pytest.approx(closed, rel=1e-4)


def test_a_pendulum_falls_over(simulate):
    """From 1 to 90 degrees off the upright: t = integral of d(theta) / sqrt(2 g (cos 1 - cos theta))."""
    fall = solve_ivp(lambda t, s: [s[1], G * np.sin(s[0])], (0, 3), [np.radians(1), 0], method="DOP853", rtol=1e-13, atol=1e-13,
                     events=lambda t, s: s[0] - np.pi / 2)
    closed = fall.t_events[0][0]
    assert closed == pytest.approx(1.6750343, abs=1e-7)
    run = simulate(pendulum(179, 4, 2.0))
    assert passages(run.time, run.position[:, 1, 2], run.velocity[:, 1, 2])[0] == pytest.approx(closed, rel=1e-4)


def test_double_pendulum(simulate):
    """Two unit masses on unit rods, both level at first: Lagrange's equations, angles from the bottom."""
    def rates(t, state):
        a, b, p, q = state
        d = a - b
        matrix = [[2, np.cos(d)], [np.cos(d), 1]]
        force = [-q * q * np.sin(d) - 2 * G * np.sin(a), p * p * np.sin(d) - G * np.sin(b)]
        return [p, q, *np.linalg.solve(matrix, force)]
    times = [0.5, 1.0, 2.0]
    truth = solve_ivp(rates, (0, 2), [np.pi / 2, np.pi / 2, 0, 0], t_eval=times, method="DOP853", rtol=1e-13, atol=1e-13).y
    tips = np.stack([np.sin(truth[0]) + np.sin(truth[1]), -np.cos(truth[0]) - np.cos(truth[1])], axis=1)
    np.testing.assert_allclose(tips[0], [1.47346567, -1.200389435], atol=1e-7)
    np.testing.assert_allclose(tips[2], [-1.434124817, -1.129870196], atol=1e-7)
    body = {"kind": "particles", "name": "arm", "positions": [[0, 0, 0], [1, 0, 0], [2, 0, 0]], "masses": [1, 1, 1],
            "sticks": [[0, 1], [1, 2]], "pinned": [0]}
    run = simulate(scene(body, 4, 2.0, iterations=8))
    found = run.position[[30, 60, 120], 2][:, [0, 2]]
    np.testing.assert_allclose(found, tips, atol=1e-3)


def cube(pinned, tilt, iterations=8):
    """Eight particles that hang from a corner or an edge (along y), turned by an angle from rest about y."""
    shape = shapes.box([SIDE] * 3, mass=8)
    points = shape.positions - shape.positions[pinned].mean(0)
    down = points.mean(0) / np.linalg.norm(points.mean(0))
    y = points[pinned[-1]] - points[pinned[0]] if len(pinned) > 1 else np.cross(down, [1.0, 0, 0])
    y /= np.linalg.norm(y)
    frame = np.stack([np.cross(y, -down), y, -down])            # world axes x, y, z in the cube's own
    turn = np.array([[np.cos(tilt), 0, -np.sin(tilt)], [0, 1, 0], [np.sin(tilt), 0, np.cos(tilt)]])
    places = (turn @ frame @ points.T).T
    return {"kind": "particles", "name": "cube", "positions": places.tolist(), "masses": [1] * 8, "pinned": pinned,
            "sticks": [[int(i), int(j), float(length)] for (i, j), length in zip(shape.sticks, shape.lengths, strict=True)]}


@pytest.mark.parametrize(("pinned", "tilt", "inertia", "arm", "reference"), [
    ([0], 0.01, 1.25 * SIDE**2, SIDE * np.sqrt(3) / 2, 1.524281), ([0, 2], 0.01, SIDE**2, SIDE / np.sqrt(2), 1.508804),
    ([0, 2], np.pi / 2, SIDE**2, SIDE / np.sqrt(2), 1.780903)], ids=["corner", "edge", "edge from 90 degrees"])
def test_swing_of_a_cube(simulate, pinned, tilt, inertia, arm, reference):
    """A physical pendulum whose inertia is that of its particles alone."""
    closed = 4 * np.sqrt(inertia / (G * arm)) * ellipk(np.sin(tilt / 2)**2)
    assert closed == pytest.approx(reference, abs=2e-5)
    run = simulate(scene(cube(pinned, tilt), 4, 3.0, iterations=8))
    times = passages(run.time, run.position[:, :, 0].mean(1), run.velocity[:, :, 0].mean(1))
    assert times[2] - times[0] == pytest.approx(closed, rel=1e-3)


def test_a_free_dumbbell_keeps_its_spin(simulate):
    for substeps in (1, 10):
        run = simulate(Path("validation/spinning_dumbbell.yaml"), START | {"solver.substeps": substeps, "time.duration": 10})
        np.testing.assert_allclose(run.measures["angular_momentum"], np.tile([0, 0, 5], (len(run.time), 1)), atol=1e-11)
        assert np.abs(run.measures["momentum"]).max() < 1e-12
        assert run.measures["fallbacks"].max() == 0


def test_a_free_cube_keeps_its_spin(simulate):
    """Angular momentum to rounding, whatever the constraints have still to go; energy to second order."""
    body = {"kind": "box", "name": "cube", "size": [SIDE] * 3, "mass": 8, "angular_velocity": [0, 0, 10]}
    run = simulate(scene(body, 1, 1.0, gravity=False))
    momentum = run.measures["angular_momentum"]
    np.testing.assert_allclose(momentum[1:], np.tile(momentum[1], (len(momentum) - 1, 1)), atol=1e-11)
    energy = run.measures["kinetic_energy"]
    assert np.sqrt(energy[-1] / energy[0]) == pytest.approx(1, abs=1e-3)
    assert run.measures["fallbacks"].max() == 0


def test_orders_of_convergence(simulate):
    fall = solve_ivp(lambda t, s: [s[1], -G * np.sin(s[0])], (0, 1), [np.pi / 2, 0], method="DOP853", rtol=1e-13, atol=1e-13)
    theta = fall.y[0, -1]
    swung, spun = [], []
    for n in HALVINGS:
        swung.append(np.linalg.norm(simulate(pendulum(90, 4 * int(n), 1.0)).position[-1, 1] - [np.sin(theta), 0, -np.cos(theta)]))
        run = simulate(Path("validation/spinning_dumbbell.yaml"), START | {"solver.substeps": 2 * int(n), "time.duration": 0.5})
        spun.append(np.linalg.norm(run.position[-1, 1] - 0.5 * np.array([np.cos(5), np.sin(5), 0])))
    np.testing.assert_allclose(slopes(swung), 2, atol=0.15)
    np.testing.assert_allclose(slopes(spun), 2, atol=0.15)


@pytest.mark.validate
def test_a_block_that_touches_slides_as_ever(simulate):
    """It is hit in every substep, so takes the present direction, and friction is Coulomb's: g (sin 30 - 0.3 cos 30) t^2 / 2."""
    run = simulate(Path("validation/incline_slides.yaml"), START)
    moved = np.linalg.norm(run.position[60].mean(0) - run.position[0].mean(0))
    assert moved == pytest.approx(G * (0.5 - 0.3 * np.sqrt(0.75)) / 2, rel=0.01)
    assert run.measures["fallbacks"][1:].min() == 4


DICE = {"version": 1, "time": {"duration": 3, "frame_rate": 60}, "seed": 3,
        "bodies": [{"kind": "icosahedron", "name": "dice", "radius": 0.2, "mass": 1, "count": 30,
                    "scatter": {"inside": [[-1.2, -1.2, -1.2], [1.2, 1.2, 1.2]], "speed": [0, 3]}, "angular_velocity": [3, 2, 6]}],
        "colliders": [{"kind": "room", "size": [3, 3, 3]}], "effects": {"gravity": [0, 0, -G]}}


@pytest.mark.validate
@pytest.mark.parametrize(("substeps", "iterations"), [(1, 10), (4, 1)])
def test_collisions_fall_back_to_present_directions(simulate, substeps, iterations):
    """Without the guard this goes to infinity."""
    run = simulate(DICE, START | {"solver.substeps": substeps, "solver.iterations": iterations})
    assert np.abs(run.position).max() < 2
    assert run.measures["fallbacks"].sum() > 100
    assert run.measures["total_energy"][-1] < run.measures["total_energy"][0]
