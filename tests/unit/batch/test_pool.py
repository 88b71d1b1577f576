"""Processes that may die."""

import os
import signal
import time

import numpy as np
import pytest
from pool_work import Parts, mark, slowly, tries

from verlet_numba.batch.pool import MOST_TRIES, Pool, Undone, _Queue, manner


def work(folder, *batches, jobs=2):
    with Pool(jobs) as pool:
        found = list(pool.work_through(mark, [Parts(tuple(batch), folder) for batch in batches]))
    assert len(found) == len(dict(found)), "a part was told twice"
    return dict(found)


def test_a_part_that_kills_its_worker_is_set_aside_and_takes_nothing_with_it(tmp_path):
    found = work(tmp_path, ["a", "die", "b"], ["once", "c"], ["error", "d"], ["e"])
    assert {key: found[key] for key in "abce"} == dict.fromkeys("abce", 0)
    assert found["once"] == 1
    assert found["die"] == Undone("its worker process died 3 times, at last by SIGKILL (out of memory?)", True)
    assert tries(tmp_path, "die") == MOST_TRIES
    assert found["error"] == found["d"] == Undone("ValueError: no such thing", False)


@pytest.mark.parametrize(("parts", "kills"), [(40, 6), pytest.param(200, 50, marks=pytest.mark.validate)])
def test_every_part_is_done_once_however_many_workers_are_killed(tmp_path, parts, kills):
    """SIGKILL at random moments, whatever the worker is at: starting, idle, in the midst of a part, telling of it."""
    keys = [f"part_{k}" for k in range(parts)]
    random, killed, found = np.random.default_rng(parts), 0, []
    with Pool(2) as pool:
        for key, outcome in pool.work_through(slowly, [Parts(tuple(keys[k:k + 8]), tmp_path) for k in range(0, parts, 8)]):
            found.append(key)
            assert not isinstance(outcome, Undone)
            if killed < kills and len(found) >= killed * parts // kills:
                time.sleep(random.uniform(0, 0.03))
                os.kill(pool._workers[random.integers(2)].process.pid, signal.SIGKILL)
                killed += 1
    assert sorted(found) == sorted(keys)
    assert killed == kills


def test_nothing_to_do_is_done(tmp_path):
    assert work(tmp_path, jobs=1) == {}


def test_a_stop_is_heeded_and_the_workers_end(tmp_path):
    asked = iter([False, True])
    with Pool(1, stop=lambda: next(asked)) as pool:
        assert list(pool.work_through(mark, [Parts(("a",), tmp_path)])) == []
        [worker] = pool._workers
    assert worker.process.exitcode is not None


def test_a_worker_ends_when_its_parent_is_gone(tmp_path):
    with Pool(1) as pool:
        [worker] = pool._workers
        assert dict(pool.work_through(mark, [Parts(("a",), tmp_path)])) == {"a": 0}
        worker.connection.close()
        worker.process.join(30)
        assert worker.process.exitcode == 1


def test_who_dies_twice_waits_until_all_else_is_done(tmp_path):
    batch = Parts(("a", "b", "c"), tmp_path)
    todo = _Queue([batch, Parts(("d",), tmp_path)])
    assert todo.next(alone=True) == batch
    assert todo.returned(batch, ["b", "c"], ["b"]) == []
    assert [todo.next(False).keys for _ in range(3)] == [("c",), ("d",), ("b",)]
    assert todo.returned(batch, ["b"], ["b"]) == []
    assert todo.next(alone=False) is None
    assert todo
    assert todo.next(alone=True).keys == ("b",)
    assert todo.returned(batch, ["b"], ["b"]) == ["b"]
    assert not todo


def test_where_others_die_and_then_succeed_a_death_counts_for_less(tmp_path):
    keys = tuple(f"part_{k}" for k in range(10))
    todo = _Queue([])
    for key in keys:
        assert todo.returned(Parts((key,), tmp_path), [key], [key]) == []
        todo.done(key)
    tries = 1
    while not todo.returned(Parts(("die",), tmp_path), ["die"], ["die"]):
        tries += 1
    assert tries == MOST_TRIES + 2


@pytest.mark.parametrize(("code", "words"), [(3, "with exit code 3"), (-signal.SIGSEGV, "by SIGSEGV"), (-199, "by signal 199")])
def test_how_a_process_ended_is_told(code, words):
    assert words in manner(code)


def test_a_killer_among_many_begun_at_once_has_three_tries(tmp_path):
    """What is simulated side by side is begun and dies together: that the others are then done speaks for none but them."""
    keys = tuple(f"part_{k}" for k in range(32))
    todo = _Queue([])
    assert todo.returned(Parts(keys, tmp_path), keys, keys) == []
    for key in keys[1:]:
        todo.done(key)
    assert todo.accidents == 0
    assert todo.returned(Parts(keys[:1], tmp_path), keys[:1], keys[:1]) == []
    assert todo.returned(Parts(keys[:1], tmp_path), keys[:1], keys[:1]) == ["part_0"]


def test_deaths_that_nothing_begun_explains_are_accidents(tmp_path):
    todo = _Queue([])
    todo.returned(Parts(("a", "b"), tmp_path), ("a", "b"), ("a", "b"))
    todo.done("a")
    assert todo.accidents == 0
    todo.done("b")
    assert todo.accidents == 1
