"""The hard cases that are about files and values, or about two runs that must agree."""

import json
from pathlib import Path

import numpy as np
import pytest

from verlet_numba.scene.load import loads
from verlet_numba.scene.prepare import prepare
from verlet_numba.scene.problems import SceneError

G = 9.81
SQUARE = "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\n"
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\n"


@pytest.fixture
def prepared(tmp_path):
    """prepared(obj, **scene): the scene with this text as the file `m.obj` beside it, ready to run."""

    def make(obj, **keys):
        (tmp_path / "m.obj").write_text(obj, encoding="utf-8")
        (tmp_path / "s.yaml").write_text(json.dumps({"version": 1, "time": {"duration": 1}, **keys}), encoding="utf-8")
        return prepare(tmp_path / "s.yaml")

    return make


# --- B8, B9, B10: triangles ---------------------------------------------------------------------------------------------

FLOOR = {"kind": "mesh", "file": "m.obj"}
BODY = {"kind": "mesh", "file": "m.obj", "mass": 1}


@pytest.mark.parametrize("obj", [SQUARE + "f 1 2 3\nf 1 3 4\nf 1 2 2\n", SQUARE + "v 0 -2 0\nf 1 2 3\nf 1 3 4\nf 1 5 2\n"])
def test_b8_triangles_without_an_area_are_refused_by_their_number(prepared, obj):
    with pytest.raises(SceneError, match=r"triangle 2 \(counted from 0, .* has no area"):
        prepared(obj, colliders=[FLOOR], bodies=[])


def test_b9_repeated_triangles_are_told_and_change_nothing(prepared):
    once = prepared(TETRAHEDRON + "f 1 4 3\n", bodies=[BODY])
    twice = prepared(TETRAHEDRON + "f 1 4 3\nf 4 3 1\n", bodies=[BODY])
    assert not once.warnings
    assert "repeat" in str(twice.warnings[0]) or "twice" in str(twice.warnings[0])
    np.testing.assert_array_equal(once.bodies[0].positions, twice.bodies[0].positions)
    np.testing.assert_array_equal(once.bodies[0].shape.triangles, twice.bodies[0].shape.triangles)
    np.testing.assert_array_equal(once.bodies[0].shape.sticks, twice.bodies[0].shape.sticks)


@pytest.mark.parametrize(("obj", "words"), [
    (TETRAHEDRON, "open|closed"), (TETRAHEDRON + "f 1 4 9\n", "index 8"),
    (TETRAHEDRON + "f 1 4 3\nv 1 1 1\nf 1 2 5\nf 2 1 5\n", "face|triangle|edge")])
def test_b10_open_wrong_and_forked_surfaces_are_refused(prepared, obj, words):
    with pytest.raises(SceneError, match=words) as caught:
        prepared(obj, bodies=[BODY])
    assert caught.value.problems[0].path == "bodies.0.file"


# --- B25, B42: values ---------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("mass", ["0", "-1", "1e-40", ".inf", ".nan", "heavy"])
def test_b25_masses_that_are_none_are_refused(mass):
    with pytest.raises(SceneError, match=r"s\.yaml:3:\d+: bodies\.0\.mass"):
        loads(f"version: 1\ntime: {{duration: 1}}\nbodies: [{{kind: box, size: [1, 1, 1], mass: {mass}}}]\n", "s.yaml")


def test_b42_a_hundred_thousand_bodies_find_no_room_at_one_point(prepared):
    with pytest.raises(SceneError, match=r"only \d of 100000 fit"):
        prepared("", bodies=[{"kind": "icosahedron", "radius": 0.1, "mass": 1, "count": 100_000,
                              "scatter": {"inside": [[0, 0, 0], [0, 0, 0]]}}])


# --- B21, B22: another scale, another place -----------------------------------------------------------------------------

def crates(scale=1.0, at=(0.0, 0.0, 0.0), apart=0.0):
    """Two boxes and a die that fall on the floor, and unless they are `apart` on each other; scaled with gravity, and shifted."""
    at = np.array(at)

    def place(x, y, z):
        return list(scale * np.array([x, y, z]) + at)

    box = {"kind": "box", "size": [0.4 * scale, 0.3 * scale, 0.2 * scale], "mass": 1}
    bodies = [{**box, "name": "low", "position": place(0, 0, 0.25), "rotation": {"axis": [1, 2, 0], "degrees": 20}},
              {**box, "name": "high", "position": place(0.1 + apart, 0.05, 0.6), "velocity": [0.5 * scale, 0, 0]},
              {"kind": "icosahedron", "name": "die", "radius": 0.2 * scale, "mass": 1, "position": place(-0.3 - apart, 0, 0.9)}]
    return {"version": 1, "time": {"duration": 1.0, "frame_rate": 60},
            "effects": {"gravity": [0, 0, -G * scale], "friction": 0.5},
            "bodies": bodies, "colliders": [{"kind": "plane", "point": list(at)}]}


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_b21_nothing_depends_on_the_scale(simulate, scale):
    run, scaled = simulate(crates()), simulate(crates(scale))
    assert run.measures["contacts"].max() > 4
    np.testing.assert_allclose(scaled.position / scale, run.position, rtol=0, atol=1e-6)


def test_b22_far_from_the_origin(simulate):
    """At 1e7 m numbers are 2e-9 m apart. Each body alone, it falls, hits the floor with an edge, tips and comes to lie."""
    at = np.array([1e7, -1e7, 1e7])
    run, far = simulate(crates(apart=2)), simulate(crates(at=at, apart=2))
    path, far_path = run.position - run.position[0], far.position - far.position[0]
    np.testing.assert_allclose(far_path[:6], path[:6], rtol=0, atol=1e-6)
    assert np.abs(path).max() > 0.5
    assert np.abs(far_path - path).max() < 1e-3 * np.abs(path).max()


def test_b22_is_told_for_single_precision(prepared):
    told = prepared("", solver={"precision": "float32"}, **{key: crates(at=(1e7, 0, 0))[key] for key in ("bodies", "colliders")})
    assert any("too coarse" in str(warning) and warning.path == "solver.precision" for warning in told.warnings)


# --- B6: the same again -------------------------------------------------------------------------------------------------

def test_b6_the_same_choice_is_made_again(simulate):
    scene = Path("hard/b06_one_pose.yaml")
    np.testing.assert_array_equal(simulate(scene).position, simulate(scene).position)


# --- B32, B33: links, counted by another measure ------------------------------------------------------------------------

def linking(one, other):
    """How often a closed polyline passes through another: signed crossings seen along z, halved."""
    return sum(crossing(one[i], one[(i + 1) % len(one)], other[j], other[(j + 1) % len(other)])
               for i in range(len(one)) for j in range(len(other))) / 2


def crossing(a, b, c, d):
    """Of segments ab and cd seen from above: 0, or the sign with which the upper one passes the lower one."""
    u, v, w = b - a, d - c, c - a
    turn = u[0] * v[1] - u[1] * v[0]
    s, t = (w[0] * v[1] - w[1] * v[0]) / turn, (w[0] * u[1] - w[1] * u[0]) / turn
    if not (0 <= s < 1 and 0 <= t < 1):
        return 0
    return np.sign(turn) * np.sign((a + s * u - c - t * v)[2])


def test_b33_links_stay_linked(simulate):
    run = simulate(Path("hard/b33_chain.yaml"))
    rings = run.position.reshape(len(run.time), 4, 16, 3)
    for frame in (*range(0, len(run.time), 20), -1):
        found = [abs(linking(rings[frame, k] + [1e-9, 2e-9, 0], rings[frame, k + 1])) for k in range(3)]
        assert found == [1, 1, 1]


def test_linking_numbers_are_those_of_known_links():
    a = 2 * np.pi * np.arange(40) / 40 + 0.01
    flat = np.stack([np.cos(a), np.sin(a), 0.1 * np.cos(3 * a)], axis=1)
    upright = np.stack([1 + np.cos(a), 0.1 * np.sin(a + 1), np.sin(a)], axis=1)
    assert abs(linking(flat, upright)) == 1
    assert linking(flat, upright + np.array([5, 0, 0])) == 0
    assert linking(flat, upright + np.array([0, 0, 3])) == 0
