"""Rigid bodies that meet the floor and each other: sliding, tipping, stacks, overlaps, collisions."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from verlet_numba.scene.shapes import icosahedron

G = 9.81
NONE = [0, 0, -1e-30]       # no gravity to speak of, but the frame loop that is compiled already
DOWN = [0, 0, -G]
FLOOR = {"kind": "plane"}
FAR = {"kind": "plane", "point": [0, 0, -100]}


def scene(bodies, duration, gravity=DOWN, friction=0.5, floor=FLOOR, **solver):
    return {"version": 1, "time": {"duration": duration, "frame_rate": 60}, "solver": solver,
            "effects": {"gravity": list(gravity), "friction": friction}, "bodies": bodies, "colliders": [floor]}


def box(name, position, size=(0.4, 0.4, 0.4), mass=1, **more):
    return {"kind": "box", "name": name, "size": list(size), "mass": mass, "position": list(position), **more}


def die(name, position, radius=0.2, mass=1, **more):
    return {"kind": "icosahedron", "name": name, "radius": radius, "mass": mass, "position": list(position), **more}


def centres(run, *sizes):
    """(T, B, 3) centres of bodies of so many particles each."""
    return np.stack([part.mean(axis=1) for part in np.split(run.position, np.cumsum(sizes)[:-1], axis=1)], axis=1)


# --- Friction ---------------------------------------------------------------------------------------------------------

def test_a_sliding_box_stops_where_friction_says(simulate):
    """After v^2 / (2 mu g) and v / (mu g)."""
    mu, v = 0.2, 2.0
    run = simulate(scene([box("crate", [0, 0, 0.2], velocity=[v, 0, 0])], 1.5, friction=mu))
    x = centres(run, 8)[:, 0]
    assert x[-1, 0] == pytest.approx(v**2 / (2 * mu * G), rel=1e-4)
    assert run.time[np.flatnonzero(run.measures["speed_max"] < 0.01)[0]] == pytest.approx(v / (mu * G), abs=1 / 60)
    t = run.time[run.time < 0.9]
    np.testing.assert_allclose(x[:len(t), 0], v * t - mu * G * t**2 / 2, atol=1e-4)
    assert np.abs(x[:, 1:] - x[0, 1:]).max() < 1e-4
    assert run.measures["speed_max"][-1] < 1e-5


def standing_die():
    """An icosahedron with a face on the floor: its rotation, height, and the direction across an edge of that face."""
    points = icosahedron(0.2, mass=1).positions
    hull = ConvexHull(points)
    face, normal = hull.simplices[0], hull.equations[0, :3]
    turn = Rotation.align_vectors([[0, 0, -1]], [normal])[0]
    corners = turn.apply(points[face])
    across = corners[:2].mean(axis=0) - corners.mean(axis=0)
    return turn, -corners[0, 2], across / np.linalg.norm(across)


@pytest.mark.parametrize("mu", [0.36, 0.41])
def test_an_icosahedron_on_a_face_tips_only_above_the_ratio_of_its_radii(simulate, mu):
    """On a slope it slides, and tips over an edge if mu exceeds inradius of the face / insphere = 0.382."""
    turn, height, across = standing_die()
    assert np.sqrt(1 / 12) / (np.sqrt(3) * (3 + np.sqrt(5)) / 12) == pytest.approx(0.382, abs=1e-3)
    slope = np.arctan(0.6)
    vector = turn.as_rotvec()
    body = die("die", [0, 0, height], rotation={"axis": list(vector), "degrees": float(np.degrees(np.linalg.norm(vector)))})
    run = simulate(scene([body], 0.5, gravity=G * (np.sin(slope) * across - np.cos(slope) * np.array([0, 0, 1])), friction=mu))
    lowest = np.sort(run.position[:, :, 2], axis=1)[:, :3]
    slid = centres(run, 12)[-1, 0] @ across
    if mu < 0.382:
        assert lowest.max() < 1e-3, "it slides flat"
        assert slid == pytest.approx(G * (np.sin(slope) - mu * np.cos(slope)) * 0.5**2 / 2, rel=0.02)
    else:
        assert lowest.max() > 0.02, "it rolls"


# --- Stacks -----------------------------------------------------------------------------------------------------------

def check_stack(run, count, size=0.4):
    x = centres(run, *[8] * count)
    heights = (np.arange(count) + 0.5) * size
    assert np.abs(x[:, :, 2] / heights - 1).max() < 5e-3
    assert np.abs(x[:, :, :2]).max() < 1e-3, "drift"
    return np.abs(x[:, :, 2] / heights - 1).max(), np.abs(x[:, :, :2]).max()


def stack(count, duration):
    return scene([box(f"box{b}", [0, 0, 0.4 * (b + 0.5)]) for b in range(count)], duration)


def test_five_boxes_stand(simulate):
    check_stack(simulate(stack(5, 4)), 5)


@pytest.mark.validate
@pytest.mark.parametrize("count", [5, 10])
def test_a_stack_stands_for_a_minute(simulate, count):
    check_stack(simulate(stack(count, 60)), count)


def test_what_touches_exactly_rests(simulate):
    """On the floor, on each other and side by side; without gravity nothing moves at all."""
    bodies = [box("low", [0, 0, 0.2]), box("high", [0, 0, 0.6]), box("beside", [0.4, 0, 0.2])]
    run = simulate(scene(bodies, 2))
    assert np.abs(run.position - run.position[0]).max() < 1e-4
    assert run.measures["speed_max"][60:].max() < 1e-3
    floating = simulate(scene(bodies, 2, gravity=NONE, floor=FAR))
    assert np.abs(floating.position - floating.position[0]).max() < 1e-11       # 960 substeps of rounding


# --- Overlaps ---------------------------------------------------------------------------------------------------------

OVERLAPS = (0.25, 0.5, 0.75, 0.9)


def test_overlapping_bodies_part_slowly(simulate):
    """Pairs that overlap by 25 to 90 % part, and never move faster than 1 m/s on the way or after."""
    bodies, sizes = [], []
    for row, overlap in enumerate(OVERLAPS):
        bodies += [box(f"a{row}", [0, 3 * row, 0]), box(f"b{row}", [0.4 * (1 - overlap), 3 * row + 0.013, 0.007]),
                   die(f"c{row}", [5, 3 * row, 0]), die(f"d{row}", [5 + 0.4 * (1 - overlap), 3 * row + 0.011, 0.003])]
        sizes += [8, 8, 12, 12]
    run = simulate(scene(bodies, 4, gravity=NONE, floor=FAR))
    x = centres(run, *sizes)
    assert run.measures["speed_max"].max() < 1
    assert np.abs(np.diff(run.position, axis=0)).max() * 60 < 1
    assert run.measures["penetration_max"][-1] < 0.005
    apart = np.linalg.norm(x[-1, 1::2] - x[-1, ::2], axis=1)
    assert (apart > 0.3).all()
    assert run.measures["constraint_error_max"].max() < 0.01


@pytest.mark.parametrize("kind", [box, die])
def test_bodies_in_one_pose_stay_finite(simulate, kind):
    """Where no direction is better than another, one is taken: always the same."""
    data = scene([kind("a", [0, 0, 1]), kind("b", [0, 0, 1]), kind("c", [0, 0, 1])], 2)
    run, again = simulate(data), simulate(data)
    assert np.isfinite(run.position).all()
    assert run.measures["speed_max"].max() < 10
    assert np.abs(run.position).max() < 5
    np.testing.assert_array_equal(run.position, again.position)


def test_a_pancake_that_grazes_does_not_fall_through(simulate):
    """1:1000, it glides and falls onto a block, a little askew."""
    bodies = [box("block", [0, 0, 0.2], size=(2, 2, 0.4), fixed=True),
              box("pancake", [-0.3, 0, 0.41], size=(1, 1, 0.001), velocity=[1, 0, 0], rotation={"axis": [1, 2, 0], "degrees": 0.5})]
    run = simulate(scene(bodies, 1))
    on_block = np.abs(run.position[:, 8:, :2]).max(axis=2) < 1
    assert run.position[:, 8:, 2][on_block].min() > 0.4 - 2e-3
    assert run.position[-1, 8:, 2].max() < 0.41
    assert run.measures["constraint_error_max"].max() < 0.05


# --- Contacts counted -------------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("bodies", "count"), [
    ([box("crate", [0, 0, 0.2])], 4), ([box("crate", [0, 0, 0.2]), box("other", [2, 0, 0.2])], 8),
    ([box("low", [0, 0, 0.2], fixed=True), box("high", [0, 0, 0.6])], 4),
    ([box("hinged", [0, 0, 0.2], pinned=[0, 2])], 1)], ids=["on the floor", "two", "on another", "hinged"])
def test_every_corner_that_something_stands_on_is_a_contact(simulate, bodies, count):
    """Once, be it on the floor or on another body; of a body that hangs on a hinge one corner takes all."""
    contacts = simulate(scene(bodies, 0.5)).measures["contacts"]
    assert (contacts[10:] == count).all()


# --- Collisions in flight ---------------------------------------------------------------------------------------------

def duel(offset=0.15):
    """Two icosahedra that hit each other off centre."""
    return [die("a", [-0.5, 0, 0], velocity=[2, 0, 0], mass=1),
            die("b", [0.5, offset, 0.05], velocity=[-2, 0, 0], mass=3, rotation={"axis": [1, 2, 3], "degrees": 50})]


def test_a_collision_keeps_the_momentum(simulate):
    run = simulate(scene(duel(), 0.5, gravity=NONE, floor=FAR))
    p = run.measures["momentum"]
    assert np.abs(p - p[0]).max() < 1e-12 * 8
    v = run.velocity[-1, :12].mean(axis=0)
    assert np.linalg.norm(v - [2, 0, 0]) > 0.5, "it was hit"


def angular_momentum_lost(simulate, substeps):
    """In the collision and after it, kg m^2/s; and the impulse of the collision, kg m/s."""
    run = simulate(scene(duel(), 0.4, gravity=NONE, floor=FAR, substeps=substeps))
    l = run.measures["angular_momentum"]
    return np.linalg.norm(l - l[0], axis=1).max(), np.linalg.norm(run.velocity[-1, :12].mean(axis=0) - [2, 0, 0])


def test_angular_momentum_is_kept_to_first_order(simulate):
    """What a step displaces by h v before it pushes by J is turned by no more than h v x J, v the speed of approach.

    A push moves bodies from where they are at the end of a step, and its speed counts from where they were at its start.
    """
    substeps = np.array([8, 16, 32, 64, 128])
    lost, push = np.array([angular_momentum_lost(simulate, n) for n in substeps.tolist()]).T
    assert (lost * 60 * substeps < 4 * push).all()
    assert np.polyfit(np.log(substeps), np.log(lost), 1)[0] == pytest.approx(-1, abs=0.25)


def pair(row):
    """A die and a box that collide, apart from all others."""
    rng = np.random.default_rng(row)
    x, y, z = 0.0, 4.0 * row, 1.0
    return [die(f"a{row}", [x, y, z], velocity=[2, 0, 0.3], angular_velocity=list(rng.normal(size=3) * 4)),
            box(f"b{row}", [x + 0.7, y + 0.1, z + 0.05], velocity=[-2, 0.2, 0.3], angular_velocity=list(rng.normal(size=3) * 4))]


def test_a_pair_among_many_has_the_bits_of_the_pair_alone(simulate):
    together = simulate(scene([body for row in range(5) for body in pair(row)], 1.5))
    assert together.measures["contacts"].max() >= 5
    for row in (0, 3):
        alone = simulate(scene(pair(row), 1.5))
        np.testing.assert_array_equal(together.position[:, 20 * row:20 * (row + 1)], alone.position)


def room(count, duration, **solver):
    """E1: icosahedra thrown into a room that they fill by a tenth."""
    side = (count * 2.5362 * 0.2**3 / 0.1)**(1 / 3)
    h = side / 2 - 0.02
    return side, {**scene([], duration, **solver), "seed": 1,
                  "bodies": [{"kind": "icosahedron", "name": "dice", "radius": 0.2, "mass": 1, "count": count,
                              "scatter": {"inside": [[-h, -h, 0.02], [h, h, side - 0.02]], "speed": [0, 3]}}],
                  "colliders": [{"kind": "room", "size": [side] * 3, "position": [0, 0, side / 2]}]}


def outside(run, side):
    x = run.position
    return max(np.abs(x[..., :2]).max() - side / 2, -x[..., 2].min(), x[..., 2].max() - side)


@pytest.mark.validate
def test_runs_repeat_and_all_pairs_are_the_pairs_of_the_grids(simulate):
    side, data = room(20, 2)
    run, again = simulate(data), simulate(data)
    np.testing.assert_array_equal(run.position, again.position)
    everything = simulate(room(20, 2, broad_phase="all_pairs")[1])
    np.testing.assert_array_equal(run.position, everything.position)
    assert outside(run, side) < 1e-3
    assert run.measures["penetration_max"].max() < 0.02


def test_dice_come_to_rest(simulate):
    run = simulate(room(20, 8)[1])
    assert run.measures["speed_max"][-60:].max() < 0.01


def test_the_papers_way_keeps_fifty_dice_in_their_room(simulate):
    side, data = room(50, 3, preset="paper")
    run = simulate(data)
    assert np.isfinite(run.position).all()
    assert outside(run, side) < 0.2
    assert run.measures["contacts"][-1] > 50
