"""The picture of measures: names that tell files apart, axes that end where rounding begins."""

import numpy as np
import pytest
from trajectories import variety

from verlet_numba.study.analyze import analyze, log_floor, plot, short_names


@pytest.mark.parametrize(("files", "names"), [
    (["a/b/flag.vtkhdf"], ["flag"]), (["a/flag.vtkhdf", "a/rope.vtkhdf"], ["flag", "rope"]),
    (["runs/1/x.vtkhdf", "runs/2/x.vtkhdf", "y.vtkhdf"], ["1/x", "2/x", "y"]), (["x.vtkhdf", "x.vtkhdf"], ["x", "x"]),
    (["x.vtkhdf", "b/x.vtkhdf"], ["x", "b/x"]), (["/x.vtkhdf"], ["x"])])
def test_names_are_as_short_as_they_differ(files, names):
    assert short_names(files) == names


def test_long_names_lose_their_middle():
    first, second = short_names([f"{'a' * 60}{end}.vtkhdf" for end in ("one", "two")])
    assert len(first) == len(second) == 44
    assert first[-3:] == "one"
    assert second[-3:] == "two"


@pytest.mark.parametrize(("values", "floor"), [
    ([0, 1e-16, 1e-3, 1e-1], 1e-7), ([1e-4, 1e-1], 1e-4), ([0.5, 1.0, 2.0], 0), ([0, 0], 0), ([np.nan, np.inf], 0)])
def test_logarithms_end_where_rounding_begins(values, floor):
    assert log_floor([np.array(values[:1]), np.array(values[1:])]) == pytest.approx(floor)


def test_many_files_fit_a_picture(tmp_path):
    path = variety(tmp_path / "variety.vtkhdf", frames=4)
    found = analyze(path, ["total_energy", "constraint_error_max"])
    plot([found._replace(file=f"folder/with/a/long/name/run_{k:03d}/trajectory.vtkhdf") for k in range(30)], tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 10_000
