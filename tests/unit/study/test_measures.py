"""Measures from a file alone: against naive twins, closed forms, and the same in pieces of any size."""

import itertools
import subprocess
import sys

import numpy as np
import pytest
from trajectories import CUBE, FRAMES, LENGTHS, MASS, PAIRS, RADIUS, RATE, SCENE, write

from verlet_numba.run.layout import BodyTable
from verlet_numba.study import measures, reader
from verlet_numba.study.from_positions import COMPUTED, crossing_pairs
from verlet_numba.study.measures import MeasureError, measurable, measure, rest_time, source


@pytest.fixture
def motion():
    """Positions and velocities of 23 particles that tremble about two cubes, three dots and a square."""
    rng = np.random.default_rng(5)
    rest = np.concatenate([CUBE, CUBE + np.array([2, 0, 0]), [[0.5, 0, 0], [0.6, 0.3, 0.1], [3, 0, 0]],
                           [[0, 0, 3], [1, 0, 3], [1, 1, 3], [0, 1, 3]]])
    return rest + 0.05 * rng.normal(size=(FRAMES, 23, 3)), rng.normal(size=(FRAMES, 23, 3))


def naive(name, x, v, time, part=slice(0, 23)):
    """One frame of a measure, particle by particle; x, v (23, 3)."""
    numbers = range(23)[part]
    g = np.array(SCENE["effects"]["gravity"])
    mass = sum(MASS[p] for p in numbers)
    match name:
        case "kinetic_energy":
            return sum(MASS[p] * (v[p] @ v[p]) / 2 for p in numbers)
        case "potential_energy":
            return -sum(MASS[p] * (g @ x[p]) for p in numbers)
        case "total_energy":
            return naive("kinetic_energy", x, v, time, part) + naive("potential_energy", x, v, time, part)
        case "momentum":
            return sum(MASS[p] * v[p] for p in numbers)
        case "angular_momentum":
            return sum(MASS[p] * np.cross(x[p], v[p]) for p in numbers)
        case "centre_of_mass":
            return sum(MASS[p] * x[p] for p in numbers) / mass
        case "constraint_error_max" | "constraint_error_rms":
            errors = [abs(np.linalg.norm(x[i] - x[j]) / length - 1) for (i, j), length in zip(PAIRS, LENGTHS, strict=True)
                      if length > 0 and i in numbers and j in numbers] or [0.0]
            return max(errors) if name.endswith("max") else np.sqrt(np.mean(np.square(errors)))
        case "speed_max":
            return max(np.linalg.norm(v[p]) for p in numbers)
        case "outside":
            return max(np.linalg.norm([max(abs(x[p, k] - (0.5, 0, 0)[k]) - 2, 0) for k in range(3)]) for p in numbers)
        case "penetration_max":
            ball = np.array([2 * time, 0, 0])
            walls = [RADIUS[p] + abs(x[p, k] - (0.5, 0, 0)[k]) - 2 for p in numbers for k in range(3)]
            return max(0, *walls, *(RADIUS[p] + 0.7 - np.linalg.norm(x[p] - ball) for p in numbers))
    raise LookupError(name)


NAIVE = [name for name in COMPUTED if name not in ("orientation_flips", "self_intersections")]


@pytest.mark.parametrize(("body", "part"), [(None, slice(0, 23)), ("crate", slice(0, 16)), ("crate.1", slice(8, 16)),
                                            ("dots", slice(16, 19)), ("sheet", slice(19, 23))])
def test_every_measure_agrees_with_its_naive_twin(tmp_path, motion, body, part):
    position, velocity = motion
    with reader.open(write(tmp_path / "x.vtkhdf", position, velocity)) as trajectory:
        found = measure(trajectory, NAIVE, body)
        for name, values in found.items():
            expected = [naive(name, *frame, part) for frame in zip(position, velocity, trajectory.time, strict=True)]
            np.testing.assert_allclose(values, expected, rtol=1e-12, atol=1e-12, err_msg=name)
    assert found["penetration_max"].max() > 0


@pytest.mark.parametrize("velocities", [True, False])
def test_pieces_of_any_size_make_the_same(tmp_path, motion, monkeypatch, velocities):
    position, velocity = motion
    with reader.open(write(tmp_path / "x.vtkhdf", position, velocity if velocities else None)) as trajectory:
        whole = measure(trajectory, list(COMPUTED))
        for frames in (1, 2, 5, FRAMES - 1):
            monkeypatch.setattr(measures, "BLOCK_NUMBERS", 3 * 23 * frames)
            for name, values in measure(trajectory, list(COMPUTED)).items():
                np.testing.assert_allclose(values, whole[name], rtol=1e-12, atol=1e-12, err_msg=name)


def test_velocities_are_second_order_differences_of_frames(tmp_path):
    """Exact for constant acceleration, at both ends too: m (v0 + a t)."""
    time = np.arange(FRAMES)[:, None, None] / RATE
    v0, a = np.random.default_rng(2).normal(size=(2, 23, 3))
    position = v0 * time + a * time**2 / 2
    with reader.open(write(tmp_path / "x.vtkhdf", position)) as trajectory:
        found = measure(trajectory, ["momentum", "speed_max"])
    velocity = v0 + a * time
    np.testing.assert_allclose(found["momentum"], np.einsum("kni,n->ki", velocity, MASS), atol=1e-11)
    np.testing.assert_allclose(found["speed_max"], np.linalg.norm(velocity, axis=2).max(axis=1), atol=1e-11)


@pytest.mark.parametrize("frames", [1, 2, 3])
def test_short_runs(tmp_path, motion, frames):
    """One frame alone has no velocity, two have one."""
    with reader.open(write(tmp_path / "x.vtkhdf", motion[0][:frames])) as trajectory:
        found = measure(trajectory, ["speed_max", "rest_time"])
    assert found["speed_max"].shape == (frames,)
    assert (found["speed_max"] > 0).all() == (frames > 1)
    assert found["rest_time"] == (0 if frames == 1 else np.inf)


def test_recorded_values_are_taken_for_the_whole_scene_alone(tmp_path, motion):
    recorded = {"kinetic_energy": np.arange(float(FRAMES)), "contacts": np.full(FRAMES, 3.0),
                "penetration_max": np.full(FRAMES, 9.0), "speed_max": np.where(np.arange(FRAMES) < 9, 1.0, 0.0)}
    with reader.open(write(tmp_path / "x.vtkhdf", *motion, observables=recorded)) as trajectory:
        for name in recorded:
            np.testing.assert_array_equal(measure(trajectory, [name])[name], recorded[name])
            assert source(trajectory, name) == "recorded"
        assert measure(trajectory, ["rest_time"])["rest_time"] == 9 / RATE
        for name in ("kinetic_energy", "penetration_max"):
            assert (measure(trajectory, [name], recorded=False)[name] != recorded[name]).all()
            assert (measure(trajectory, [name], "dots")[name] != recorded[name]).all()
            assert source(trajectory, name, "dots") == source(trajectory, name, recorded=False)
        assert source(trajectory, "kinetic_energy", "dots") == "positions"
        assert source(trajectory, "penetration_max", "dots") == "positions, in colliders alone"
        assert measurable(trajectory, ["contacts", "momentum"]) == ["contacts", "momentum"]
        assert measurable(trajectory, ["contacts", "momentum"], "dots") == ["momentum"]


@pytest.mark.parametrize(("names", "body", "words"), [
    (["contacts"], "dots", "whole scene"), (["resting"], None, "records"), (["momentum"], "dot", "crate, dots, sheet"),
    (["momentun"], None, "no measure")])
def test_what_cannot_be_measured_is_said(tmp_path, motion, names, body, words):
    with reader.open(write(tmp_path / "x.vtkhdf", *motion)) as trajectory, pytest.raises(MeasureError, match=words):
        measure(trajectory, names, body)


def test_depth_in_a_mesh_is_what_the_run_recorded(tmp_path, motion):
    """Its triangles are not in the trajectory."""
    scene = {**SCENE, "colliders": [*SCENE["colliders"], {"kind": "mesh", "file": "bowl.obj", "name": "bowl"}]}
    path = write(tmp_path / "x.vtkhdf", *motion, scene=scene, observables={"penetration_max": np.full(FRAMES, 0.5)})
    with reader.open(path) as trajectory:
        assert (measure(trajectory, ["penetration_max"])["penetration_max"] == 0.5).all()
        assert measurable(trajectory, ["penetration_max"], recorded=False) == []
        with pytest.raises(MeasureError, match="triangles of bowl"):
            measure(trajectory, ["penetration_max"], "crate")


@pytest.mark.parametrize(("speed", "expected"), [
    ([0, 0, 0], 0.0), ([1, 0, 0], 0.1), ([1, 0, 1, 0.0099], 0.3), ([1, 1], np.inf), ([0, 0.01], np.inf), ([], np.inf),
    ([0, np.nan, 0], 0.2)])
def test_rest_time_is_when_the_last_motion_is_over(speed, expected):
    assert rest_time(np.arange(len(speed)) / 10, np.array(speed)) == pytest.approx(expected)


def test_flips_are_counted_however_a_body_is_turned(tmp_path):
    """Turned, squashed without being flat, moved: the same hand. Mirrored: the other. Flat bodies have none."""
    rng = np.random.default_rng(4)
    turns = np.linalg.qr(rng.normal(size=(6, 3, 3)))[0]
    turns *= np.sign(np.linalg.det(turns))[:, None, None]
    squash = np.diag([1, 1, 0.03])
    mirror = np.diag([1, 1, -1])
    one = np.stack([(CUBE @ turn.T) + k for k, turn in enumerate(turns)])
    other = np.stack([CUBE, CUBE @ squash, CUBE @ mirror, CUBE @ mirror @ squash, CUBE @ turns[0].T @ mirror, CUBE])
    flat = np.stack([CUBE * [1, 1, 0], *[CUBE * [1, 1, s] for s in (1, -1, 1, -1, 1)]])
    table = BodyTable(["a", "b", "c"], ["box", "mesh", "box"], [0, 8, 16], [8, 8, 8], [0] * 3, [0] * 3, [1.0] * 3)
    path = write(tmp_path / "x.vtkhdf", np.concatenate([one, other, flat], axis=1), scene={"bodies": []}, table=table,
                 pairs=np.zeros((0, 2), int), lengths=np.zeros(0), triangles=np.zeros((0, 3), int))
    with reader.open(path) as trajectory:
        np.testing.assert_array_equal(measure(trajectory, ["orientation_flips"])["orientation_flips"], [0, 0, 1, 1, 1, 0])
        np.testing.assert_array_equal(measure(trajectory, ["orientation_flips"], "a")["orientation_flips"], 0)


def crosses(p, q):
    """Whether triangles cross: a side of the one passes through the inside of the other."""
    return any(pierces(p[i], p[(i + 1) % 3], q) or pierces(q[i], q[(i + 1) % 3], p) for i in range(3))


def pierces(a, b, triangle):
    """A segment meets a triangle's inside: solve a + s (b - a) = t0 + u (t1 - t0) + v (t2 - t0)."""
    matrix = np.stack([b - a, triangle[0] - triangle[1], triangle[0] - triangle[2]], axis=1)
    if abs(np.linalg.det(matrix)) < 1e-14:
        return False
    s, u, v = np.linalg.solve(matrix, triangle[0] - a)
    return 1e-12 < s < 1 - 1e-12 and u > 1e-12 and v > 1e-12 and u + v < 1 - 1e-12


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("shift", [0.0, 1e3])
def test_crossing_pairs_are_those_of_brute_force(seed, shift):
    """Triangles that share no, one and two corners; far from the origin too."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(40, 3))
    triangles = np.array([rng.choice(40, 3, replace=False) for _ in range(60)])
    expected = sum(crosses(points[a], points[b]) for a, b in itertools.combinations(triangles, 2) if len({*a} & {*b}) < 2)
    assert expected > 20
    assert crossing_pairs(points + shift, triangles) == expected


def test_crossings_of_known_surfaces():
    """A flat sheet has none; pushed through itself by one corner it has; two that touch have none."""
    side = np.arange(6.0)
    sheet = np.stack([*np.meshgrid(side, side, indexing="ij"), np.zeros((6, 6))], axis=2).reshape(-1, 3)
    cell = np.array([[6 * i + j + k for k in each] for i in range(5) for j in range(5) for each in ((0, 6, 7), (0, 7, 1))])
    assert crossing_pairs(sheet, cell) == 0
    folded = sheet.copy()
    folded[35] = [1.3, 1.6, -0.5]           # a corner of the sheet, bent under it
    folded[[28, 29, 34]] += [0, 0, 0.5]
    assert crossing_pairs(folded, cell) > 0
    two = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.2, 0], [0.2, 0.2, 1], [1, 1, 1]], float)
    pair = np.array([[0, 1, 2], [3, 4, 5]])
    assert crossing_pairs(two, pair) == 0
    assert crossing_pairs(two - np.array([0, 0, 0.1]) * (np.arange(6) > 2)[:, None], pair) == 1
    assert crossing_pairs(np.zeros((0, 3)), np.zeros((0, 3), int)) == 0
    assert crossing_pairs(np.ones((6, 3)), pair) == 0


def test_measuring_loads_no_simulator():
    """Nor do matplotlib, trimesh and scipy come with it."""
    heavy = {"numba", "llvmlite", "matplotlib", "trimesh", "scipy"}
    code = f"import sys, verlet_numba.study.analyze, verlet_numba.study.compare; print(*{heavy} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "\n"
