"""One scene in the compiled form of the scene of everything: a mesh as a floor, ropes that wake, ropes that are tied to boxes."""

import numpy as np
import pytest
import trimesh
import worlds

from verlet_numba.buffers.world import RESTING

pytestmark = pytest.mark.validate        # what rests compiles for minutes

FRAMES, SPEED = 45, 2.0
CRATE = {"kind": "box", "size": [0.3, 0.3, 0.2], "mass": 1, "friction": 0.5, "restitution": 0}
DIE = {"kind": "icosahedron", "radius": 0.1, "mass": 1, "friction": 0.5, "restitution": 0}
ON_A_FACE = {"axis": [0, 1, 0], "degrees": -20.9051574}
TURNED = {"axis": [0, 0, 1], "degrees": 27}
SLIDING = [CRATE | {"name": "straight", "position": [39, 0.013, 0.1], "velocity": [SPEED, 0, 0]},
           CRATE | {"name": "askew", "position": [39, 0.6, 0.1], "velocity": [SPEED, 0, 0], "rotation": TURNED},
           DIE | {"name": "on_face", "position": [39, -0.6, 0.0794654472], "velocity": [SPEED, 0, 0], "rotation": ON_A_FACE}]
RESTING_ONES = [CRATE | {"name": "hit", "position": [30, 0, 0.1]}, CRATE | {"name": "spared", "position": [30, 0.8, 0.1]}]
FALLING = {"kind": "rope", "name": "falling", "start": [29.9, 0, 0.8], "end": [30.1, 0, 0.8], "segments": 4, "mass": 0.2,
           "thickness": 0.04}
TIED = [CRATE | {"name": "held", "position": [20, 0, 0], "fixed": True},
        {"kind": "rope", "name": "thick", "start": [20.15, 0.15, -0.1], "end": [21.15, 0.15, -0.1], "segments": 20, "mass": 0.5,
         "thickness": 0.12}]
NOTHING = {"drag": {"linear": 1e-30}, "damping": 1e-30, "wind": {"velocity": [1, 0, 0], "density": 1e-30},
           "gravity": [0, 0, -9.81], "rest": {"time": 0.1}}


def tessellated(cells=12, size=3.2):
    """An irregularly tessellated square in the plane z = 0."""
    rng, line = np.random.default_rng(0), np.linspace(-size / 2, size / 2, cells + 1)
    place = np.stack([*np.meshgrid(line, line, indexing="ij"), np.zeros((cells + 1, cells + 1))], axis=-1)
    place[1:-1, 1:-1, :2] += rng.uniform(-0.3, 0.3, (cells - 1, cells - 1, 2)) * size / cells
    i = np.arange((cells + 1)**2).reshape(cells + 1, -1)[:-1, :-1].ravel()
    halves = np.stack([i, i + cells + 1, i + cells + 2], 1), np.stack([i, i + cells + 2, i + 1], 1)
    return trimesh.Trimesh(place.reshape(-1, 3), np.concatenate(halves), process=False)


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    """Positions (T, P, 3) of every body, first copies and others one after another; and the measures."""
    file = tmp_path_factory.mktemp("floor") / "floor.obj"
    tessellated().export(file)
    floors = [{"kind": "mesh", "file": str(file), "position": [40, 0, 0], "friction": 0},
              {"kind": "box", "size": [3, 3, 1], "position": [30, 0, -0.5]}]
    others = [entry for entry in worlds.EVERYTHING["colliders"] if entry["kind"] != "room"]
    corner = np.flatnonzero((worlds.placed({"time": {"duration": 1}, "bodies": TIED})[1][0].positions[0]
                             == TIED[1]["start"]).all(1))[0]
    scene = worlds.with_changes(
        worlds.EVERYTHING, effects=NOTHING, solver={"substeps": 8}, colliders=[*others, *floors],
        bodies=[*worlds.EVERYTHING["bodies"], *SLIDING, *RESTING_ONES, FALLING, *TIED],
        attachments=[*worlds.EVERYTHING["attachments"], ["thick", 0, "held", int(corner)]])
    model = worlds.started(scene)
    assert [name for name, effect in model.world.effects._asdict().items() if effect is None] == [
        "features", "exact", "rapid", "bending"]
    position, _, measures = worlds.advanced(model, FRAMES)
    cuts = np.cumsum([body.copies * len(body.shape.positions) for body in model.bodies])[:-1]
    return {body.name: part for body, part in zip(model.bodies, np.split(position, cuts, axis=1), strict=True)}, measures


@pytest.mark.parametrize("body", ["straight", "askew", "on_face"])
def test_a_body_slides_straight_over_a_tessellated_floor(seen, body):
    """Edges within the floor neither stop nor turn nor lift it (B18)."""
    place = seen[0][body]
    expected = place[0] + np.arange(FRAMES)[:, None, None] / 60 * [SPEED, 0, 0]
    np.testing.assert_allclose(place[..., :2], expected[..., :2], atol=1e-3)
    np.testing.assert_allclose(place[..., 2], expected[..., 2], atol=3e-4)


def test_bodies_rest_until_a_rope_falls_on_them(seen):
    """And stay awake while it lies there; beside them others rest on."""
    resting = seen[1][:, RESTING]
    lowest = seen[0]["falling"][..., 2].min(axis=1)
    before, after = np.flatnonzero(lowest > 0.25), np.flatnonzero(lowest < 0.222)
    first = int(np.argmax(resting == 2))
    assert 0 < first < before[-1] - 5
    assert (resting[first:before[-1]] == 2).all()
    assert len(after) > 10
    assert (resting[after] == 1).all()
    np.testing.assert_array_equal(seen[0]["spared"][first:], np.broadcast_to(seen[0]["spared"][first], (FRAMES - first, 8, 3)))


def test_a_thick_rope_hangs_where_it_is_tied(seen):
    """The hull of what it is tied to does not push its first particles away."""
    place = seen[0]["thick"]
    assert np.linalg.norm(place[:, 0] - TIED[1]["start"], axis=1).max() < 1e-3
    length = np.linalg.norm(np.diff(place, axis=1), axis=2)
    assert length.max() < 0.05 * 1.08
    assert place[-1, -1, 2] < -0.5, "it swings down"
