"""Effects of parameters on measures."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from verlet_numba.study.sweep_folder import Result, Row, Table, cell, failures, short
from verlet_numba.study.sweep_picture import Axis, draw, explained, logarithmic, means, varying

RNG = np.random.default_rng(5)


def table(values, **measures):
    rows = [Row(list(row), Result(f"{k}", "complete", 1.0, {name: column[k] for name, column in measures.items()}))
            for k, row in enumerate(zip(*values.values(), strict=True))]
    return Table(Path("s.sweep"), list(values), list(measures), rows, len(rows))


def test_the_share_explained_is_that_of_the_analysis_of_variance():
    levels, noise = np.repeat([0.0, 1.0, 2.0], 200), RNG.normal(size=600)
    assert explained(Axis("a", levels.tolist()), 3 * levels) == 1.0
    assert explained(Axis("a", levels.tolist()), noise) == pytest.approx(0, abs=0.02)
    assert explained(Axis("a", levels.tolist()), levels + noise) == pytest.approx((2 / 3) / (2 / 3 + 1), abs=0.05)


def test_a_parameter_lies_along_its_axis():
    words = Axis("a", ["x", [0, 0.123456], "x", "b"])
    assert (words.words, words.at.tolist()) == (["[0, 0.1235]", "b", "x"], [2, 0, 2, 1])
    assert Axis("a", np.geomspace(0.1, 100, 30).tolist()).logarithmic
    assert not Axis("a", np.linspace(0.1, 100, 30).tolist()).logarithmic
    many = Axis("a", RNG.uniform(size=40).tolist())
    assert [mask.sum() for mask in many.bins()] == [5] * 8
    assert sum(mask.astype(int) for mask in many.bins()).tolist() == [1] * 40


def test_means_pass_over_what_is_missing():
    at, mean = means(Axis("a", [1, 1, 2, 2, 3]), np.array([1.0, 3.0, np.nan, 5.0, np.nan]))
    assert (at.tolist(), mean.tolist()) == ([1, 2], [2, 5])


def test_measures_that_never_differ_are_left_out():
    known = table({"a": [1, 2]}, same=[1.0, 1.0], other=[1.0, 2.0], gone=[None, None])
    assert list(varying(known)) == ["other"]
    assert not logarithmic(np.array([1e-16, 1.0]))
    assert logarithmic(np.array([1e-3, 1.0, np.nan]))


@pytest.mark.parametrize("known", [
    table({"a": [1, 2], "b": ["x", "y"]}, one=[1.0, 2.0]), table({"a": [1, 2]}, one=[1.0, 1.0]), table({"a": []}, one=[]),
    table({"a": [1, 2, 3]}, one=[1.0, 2.0, None], two=[1.0, 5.0, 100.0], three=[0.0, -1.0, 1.0])])
def test_every_table_can_be_drawn(known, tmp_path):
    draw(known, tmp_path / "p.png")
    with Image.open(tmp_path / "p.png") as picture:
        assert picture.width >= 500


def test_values_are_told_in_few_characters():
    assert short(0.123456789) == "0.123457"
    assert short([1, 0.3333333]) == "[1, 0.3333]"
    assert short("a" * 50) == "a" * 21 + "..."
    assert [cell(value) for value in (None, 1, 2.5, "x", True, [1, 2])] == ["", 1, 2.5, "x", "true", "[1, 2]"]


def test_many_failures_of_one_reason_are_told_in_few_lines():
    rows = [Row([k], Result(f"id{k}", "failed", 0.0, {}, reason="no room")) for k in range(30)]
    told = list(failures(rows, ["a"]))
    assert told[0] == "30 failed: no room"
    assert told[1] == "  id0  a=0"
    assert told[-1] == "  ... and 20 more"
    assert len(told) == 12
