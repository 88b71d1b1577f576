"""The points of a sweep."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from verlet_numba.batch.sample import points, within
from verlet_numba.batch.schema import Parameter, Sweep

MASS, FRICTION, STEPS = "bodies.crate.mass", "effects.friction", "solver.substeps"


def sweep(parameters, **keys):
    return Sweep.model_validate({"version": 1, "scene": "s.yaml", "parameters": parameters, **keys})


def values(parameters, whole=(), **keys):
    return [tuple(choice.value for choice in point) for point in points(sweep(parameters, **keys), whole)]


def test_grid_has_every_combination_the_first_parameter_slowest():
    assert values({MASS: [1, 2], FRICTION: {"values": ["a", [0, 1], None]}}) == [
        (1, "a"), (1, [0, 1]), (1, None), (2, "a"), (2, [0, 1]), (2, None)]


def test_zip_takes_values_side_by_side():
    assert values({MASS: [1, 2, 3], FRICTION: {"min": 0, "max": 1}}, method="zip", samples=3) == [(1, 0.0), (2, 0.5), (3, 1.0)]


def test_a_range_in_a_grid_has_even_steps_from_end_to_end():
    assert values({MASS: {"min": 1, "max": 100, "distribution": "log_uniform"}}, method="grid", samples=3) == [(1,), (10,), (100,)]
    assert values({STEPS: {"min": 1, "max": 3}}, whole=[STEPS], method="grid", samples=5) == [(1,), (2,), (3,)]
    assert values({MASS: {"min": 1, "max": 3}}, method="grid", samples=1) == [(2,)]


@pytest.mark.parametrize("method", ["random", "lhs", "sobol"])
@pytest.mark.parametrize("samples", [1, 7, 64])
def test_drawn_points_are_as_many_as_asked_in_range_and_the_same_for_the_same_seed(method, samples):
    parameters = {MASS: {"min": 0.05, "max": 0.5, "distribution": "log_uniform"}, FRICTION: {"values": [0.2, 0.5, 0.8]},
                  STEPS: {"min": 4, "max": 9}}
    found = values(parameters, [STEPS], method=method, samples=samples, seed=3)
    assert len(found) == samples
    assert all(0.05 <= mass <= 0.5 and friction in (0.2, 0.5, 0.8) and steps in range(4, 10) and isinstance(steps, int)
               for mass, friction, steps in found)
    assert found == values(parameters, [STEPS], method=method, samples=samples, seed=3)
    assert found != values(parameters, [STEPS], method=method, samples=samples, seed=4)


def test_a_latin_hypercube_has_one_point_in_every_row_of_every_parameter():
    found = np.array(values({MASS: {"min": 1, "max": 2}, FRICTION: {"min": 1, "max": 100, "distribution": "log_uniform"}},
                            method="lhs", samples=20))
    cells = np.stack([(found[:, 0] - 1) * 20, np.log(found[:, 1]) / math.log(100) * 20]).astype(int)
    assert (np.sort(cells) == np.arange(20)).all()


def test_sobol_halves_are_even():
    found = np.array(values({MASS: {"min": 0, "max": 1}, FRICTION: {"min": 0, "max": 1}}, method="sobol", samples=64))
    assert ((found < 0.5).sum(axis=0) == 32).all()


def test_values_of_a_list_are_drawn_equally_often():
    found = values({MASS: ["a", "b", "c", "d"]}, method="lhs", samples=40)
    assert all(found.count((word,)) == 10 for word in "abcd")


def test_the_method_follows_from_the_parameters():
    assert sweep({MASS: [1]}).way == "grid"
    assert sweep({MASS: {"min": 0, "max": 1}}, samples=2).way == "lhs"


@given(st.floats(1e-6, 1e6), st.floats(1.001, 1e6), st.floats(0, 1), st.sampled_from(["uniform", "log_uniform"]))
def test_values_keep_to_their_range(low, ratio, u, law):
    parameter = Parameter(min=low, max=low * ratio, distribution=law)
    value = within(parameter, u, False)
    assert low <= value <= low * ratio
    exact = low * ratio**u if law == "log_uniform" else low + u * (low * ratio - low)
    assert value == pytest.approx(exact, rel=1e-8)
