"""Measures as single figures."""

import numpy as np
import pytest
from trajectories import write

from verlet_numba.study import figures, reader
from verlet_numba.study.measures import MeasureError


def test_each_measure_has_its_usual_figure_and_any_other_by_name(tmp_path):
    position = np.zeros((3, 23, 3))
    path = write(tmp_path / "t.vtkhdf", position, observables={
        "speed_max": np.array([0.5, 2.0, 1.0]), "relaxations": np.array([1.0, 2.0, 3.0]), "total_energy": np.array([3.0, 1.0, 2.0]),
        "momentum": np.arange(9.0).reshape(3, 3)})
    names = ["speed_max", "speed_max.last", "relaxations", "total_energy", "total_energy.least", "momentum", "momentum.first",
             "rest_time", "contacts"]
    with reader.open(path) as trajectory:
        found = figures.figures(trajectory, names)
    assert list(found) == figures.columns(names)
    assert found == {"speed_max": 2.0, "speed_max.last": 1.0, "relaxations": 6.0, "total_energy": 2.0, "total_energy.least": 1.0,
                     "momentum_x": 6.0, "momentum_y": 7.0, "momentum_z": 8.0, "momentum_x.first": 0.0, "momentum_y.first": 1.0,
                     "momentum_z.first": 2.0, "rest_time": None, "contacts": None}
    assert (figures.unit("momentum_x.first"), figures.unit("speed_max"), figures.unit("contacts")) == ("kg m/s", "m/s", "")


@pytest.mark.parametrize("name", ["speed", "speed_max.middle", "rest_time.last", "speed_max."])
def test_names_that_there_are_not_are_refused(tmp_path, name):
    path = write(tmp_path / "t.vtkhdf", np.zeros((1, 23, 3)))
    with reader.open(path) as trajectory, pytest.raises(MeasureError):
        figures.figures(trajectory, [name])
