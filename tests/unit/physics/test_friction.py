"""Coulomb friction on displacements."""

import pytest

from verlet_numba.physics.friction import held


def test_static_cone_holds_everything_and_sliding_gives_back_dynamic_times_the_push():
    assert held(0.5, 1.0, 0.5, 0.3) == 1
    assert held(0.5001, 1.0, 0.5, 0.3) * 0.5001 == pytest.approx(0.3)
    assert held(4.0, 2.0, 0.5, 0.3) * 4.0 == pytest.approx(0.6)


def test_nothing_is_held_without_push_or_without_friction():
    assert held(0.1, 0.0, 0.5, 0.3) == 0
    assert held(0.1, 1.0, 0.0, 0.0) == 0


def test_more_is_never_taken_back_than_slid():
    for slide in (1e-9, 0.1, 0.49, 0.51, 3.0):
        assert held(slide, 1.0, 0.5, 0.5) <= 1
