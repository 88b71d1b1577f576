"""Animations take as long as what they show, whatever the frame rate."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image
from trajectories import variety

from verlet_numba.study import moving
from verlet_numba.study.render import render

RATES = st.sampled_from([10, 24, 25, 30, 48, 50, 60, 100, 120, 240, 1000])


@given(RATES, st.integers(2, 400))
def test_a_gif_plays_in_the_time_it_shows(rate, frames):
    clock = moving.clock(np.arange(frames) / rate)
    kept = moving.apart(clock, 0.02)
    delays = moving.delays(clock[kept])
    assert len(kept) == 1 or delays.min() >= 2
    assert len(set(np.diff(kept))) <= 1
    assert len(kept) < 3 or len(set(delays)) <= 2
    ends = np.cumsum(delays)[:-1] * 0.01        # each picture comes at its own time
    assert np.abs(ends - clock[kept][1:]).max(initial=0) <= 0.005 + 1e-9


@given(st.lists(st.floats(0, 20), min_size=1, max_size=40))
def test_frames_in_any_order_are_shown_at_least_the_shortest_time_apart(times):
    clock = moving.clock(np.array(times))
    kept = moving.apart(clock, 0.02)
    assert kept[0] == 0
    assert (np.diff(clock[kept]) > 0.02 - 1e-6).all()


@given(RATES, st.integers(1, 300))
def test_a_film_shows_what_is_due(rate, frames):
    clock = moving.clock(np.arange(frames) / rate)
    clock = clock[moving.apart(clock, 1 / 60)]
    beat, shown = moving.beats(clock)
    assert beat <= 60 + 1e-6
    assert len(shown) / beat == pytest.approx(clock[-1] + 1 / beat)
    np.testing.assert_array_equal(shown, np.arange(len(clock)))


def test_a_film_repeats_what_lasts():
    beat, shown = moving.beats(np.array([0.0, 0.1, 0.4]))
    assert beat == pytest.approx(10)
    assert shown.tolist() == [0, 1, 1, 1, 2]


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory):
    return variety(tmp_path_factory.mktemp("moving") / "variety.vtkhdf")


def test_half_a_second_at_60_frames_a_second_is_half_a_second_of_gif(trajectory, tmp_path):
    assert render(trajectory, tmp_path / "a.gif", width=60, height=44) == list(range(0, 31, 2))
    with Image.open(tmp_path / "a.gif") as image:
        lasts = 0
        for number in range(image.n_frames):
            image.seek(number)
            lasts += image.info["duration"]
    assert lasts == 530         # ms: half a second, and the last picture


def test_a_film_has_its_rate_size_and_length(trajectory, tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    assert render(trajectory, tmp_path / "a.mp4", [slice(0, 31, 2)], width=61, height=45) == list(range(0, 31, 2))
    told = next(ffmpeg.read_frames(str(tmp_path / "a.mp4")))
    assert (told["codec"], told["size"], told["fps"]) == ("h264", (60, 44), 30)
    assert ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4"))[0] == 16
