"""Where two trajectories part: the first frame, body, copy and particle."""

import numpy as np
import pytest
from trajectories import FRAMES, PAIRS, SCENE, TABLE, write

from verlet_numba.study import compare as comparing
from verlet_numba.study import reader
from verlet_numba.study.compare import compare

START = np.random.default_rng(8).normal(size=(FRAMES, 23, 3))


def differ(tmp_path, other, tolerance=0.0, **changes):
    """What `compare` finds between START and another motion, there and back."""
    write(tmp_path / "a.vtkhdf", START)
    write(tmp_path / "b.vtkhdf", other, **changes)
    with reader.open(tmp_path / "a.vtkhdf") as a, reader.open(tmp_path / "b.vtkhdf") as b:
        found, back = compare(a, b, tolerance), compare(b, a, tolerance)
    assert (found is None) == (back is None)
    return found


@pytest.mark.parametrize("most", [1, 7, FRAMES])
def test_the_first_difference_is_found(tmp_path, monkeypatch, most):
    monkeypatch.setattr(comparing, "BLOCK_NUMBERS", 3 * 23 * most)
    other = START.copy()
    other[9, 11] += [0.03, 0, 0.04]         # particle 3 of crate.1
    other[9, 20] += 7
    other[12:] += 1
    found = differ(tmp_path, other)
    assert found[1:6] == (9, pytest.approx(9 / 60), "crate", 1, 3)
    assert found.distance == pytest.approx(0.05)
    assert "frame 9, 0.15 s: body crate, copy 1, particle 3: 0.05 m apart" in str(found)
    assert differ(tmp_path, other, 0.06)[1:6] == (9, pytest.approx(9 / 60), "sheet", None, 1)
    assert differ(tmp_path, other, 1.5)[1:6] == (9, pytest.approx(9 / 60), "sheet", None, 1)
    assert differ(tmp_path, other[:12], 13).reason
    assert differ(tmp_path, other, 20) is None


def test_equal_files_do_not_differ(tmp_path):
    assert differ(tmp_path, START.copy()) is None


def test_the_last_bit_counts(tmp_path):
    other = START.copy()
    other[-1, 22, 2] = np.nextafter(other[-1, 22, 2], 9)
    assert differ(tmp_path, other)[1:6] == (FRAMES - 1, pytest.approx((FRAMES - 1) / 60), "sheet", None, 3)
    assert differ(tmp_path, other, 1e-12) is None


def test_runs_of_other_lengths_times_and_bodies_differ(tmp_path):
    assert f"has {FRAMES} frames" in differ(tmp_path, START[:9]).reason
    named = TABLE._replace(name=["crate.0", "crate.1", "dust", "sheet"])
    assert "body dots" in differ(tmp_path, START, table=named).reason
    fewer = TABLE._replace(**{key: getattr(TABLE, key)[:3] for key in TABLE._fields})
    assert "particles" in differ(tmp_path, START[:, :19], table=fewer, pairs=PAIRS[:4], lengths=np.ones(4),
                                 triangles=np.zeros((0, 3), int), scene=SCENE).reason


def test_frames_at_other_times_differ(tmp_path):
    assert "frame 1 is at" in differ(tmp_path, START, rate=50).reason
