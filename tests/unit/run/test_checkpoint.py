"""Checkpoints: what they hold comes back, whatever a kill or damage does to their files."""

import os

import numpy as np
import pytest
import worlds
from hypothesis import given, settings
from hypothesis import strategies as st

from verlet_numba.run import checkpoint
from verlet_numba.run.engine import spread_over


@pytest.fixture(scope="module")
def world():
    return worlds.started(worlds.EVERYTHING).world


def write(path, world, frames):
    checkpoint.write(path, {"start": "here"}, {"frames": frames}, world)


def test_everything_comes_back(world, tmp_path):
    write(tmp_path / "a.vtkhdf", world, 7)
    found = checkpoint.newest(tmp_path / "a.vtkhdf", 7)
    assert (found.origin, found.summary, found.frames) == ({"start": "here"}, {"frames": 7}, 7)
    other = checkpoint.restored(world, found.arrays)
    assert type(other) is type(world)
    assert checkpoint.scalars(other) == checkpoint.scalars(world)
    for (name, a), (again, b) in zip(checkpoint.arrays(world), checkpoint.arrays(other), strict=True):
        assert name == again
        np.testing.assert_array_equal(a, b)
        assert a.dtype == b.dtype
        assert a.shape == b.shape
        assert b.flags.writeable
        assert b.flags.c_contiguous
        assert not np.shares_memory(a, b)
    size = (tmp_path / "a.vtkhdf.checkpoint").stat().st_size
    assert size - 20_000 < checkpoint.size(world) < size


def test_the_number_of_threads_may_change(world, tmp_path, monkeypatch):
    """Several have scratch of their own, which a run on one thread has not."""
    monkeypatch.setattr("verlet_numba.run.engine.MANY", 0)
    one, two = worlds.started(worlds.EVERYTHING), spread_over(worlds.started(worlds.EVERYTHING), 2)
    assert one.world.effects.meet.beside is None
    one.world.particles.position[:], two.world.particles.position[:] = 1, 2
    for writer, reader, value in ((one, two, 1), (two, worlds.started(worlds.EVERYTHING), 2)):
        write(tmp_path / "a", writer.world, 1)
        found = checkpoint.restored(reader.world, checkpoint.newest(tmp_path / "a", 1).arrays)
        assert (found.particles.position == value).all()
        assert checkpoint.scalars(found) == checkpoint.scalars(reader.world)


def test_the_origin_changes_with_any_array_or_number(world):
    origin = checkpoint.origin(world)
    assert checkpoint.origin(worlds.started(worlds.EVERYTHING).world) == origin
    assert checkpoint.origin(world._replace(solver=world.solver._replace(substeps=5)))["start"] != origin["start"]
    moved = world.particles.position.copy()
    moved[1, 3] = np.nextafter(moved[1, 3], 9)
    assert checkpoint.origin(world._replace(particles=world.particles._replace(position=moved)))["start"] != origin["start"]


def test_one_that_counts_more_frames_than_there_are_is_passed_over(world, tmp_path):
    write(tmp_path / "a", world, 5)
    write(tmp_path / "a", world, 9)
    assert [checkpoint.newest(tmp_path / "a", frames) and checkpoint.newest(tmp_path / "a", frames).frames
            for frames in (9, 8, 5, 4)] == [9, 5, 5, None]


class KilledError(BaseException):
    """The process ends here."""


@pytest.mark.parametrize("step", range(4))
@pytest.mark.parametrize("written", [0, 1, 100, -1, None])
def test_a_kill_at_any_moment_leaves_a_whole_one(world, tmp_path, monkeypatch, step, written):
    """Before the data are on the disk, of which any part may be; before either renaming; and after both."""
    path, calls = tmp_path / "a", []
    write(path, world, 1)
    write(path, world, 2)

    def until(name):
        call = getattr(os, name)

        def wrapper(*arguments):
            if len(calls) == step:
                raise KilledError
            calls.append(name)
            return call(*arguments)
        monkeypatch.setattr(os, name, wrapper)

    until("fsync"), until("replace")
    try:
        write(path, world, 3)
    except KilledError:
        assert step < 3
    monkeypatch.undo()
    part = checkpoint.names(path)[2]
    assert part.exists() == (step < 3)
    if step == 0 and written is not None:
        part.write_bytes(part.read_bytes()[:written])
    assert checkpoint.newest(path, 9).frames == (3 if step == 3 else 2)
    write(path, world, 4)
    assert checkpoint.newest(path, 9).frames == 4
    checkpoint.remove(path)
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    path = tmp_path_factory.mktemp("checkpoint") / "a"
    write(path, worlds.started(worlds.FREE).world, 7)
    return checkpoint.names(path)[0].read_bytes()


@settings(max_examples=200)
@given(cut=st.floats(0, 1), place=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7), flip=st.booleans())
def test_damage_is_noticed(data, tmp_path_factory, cut, place, bit, flip):
    """A flipped bit, or an end that is missing."""
    damaged = bytearray(data if flip else data[:int(cut * (len(data) - 1))])
    if flip:
        damaged[int(place * len(data))] ^= 1 << bit
    path = tmp_path_factory.getbasetemp() / "damaged.checkpoint"
    path.write_bytes(damaged)
    assert checkpoint.read(path) is None
