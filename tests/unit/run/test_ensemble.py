"""Files of scenes simulated together: those of each alone, whatever befalls the others and whoever does the work."""

import hashlib
import json
from dataclasses import replace

import h5py
import numpy as np
import pytest
import worlds

from verlet_numba.run.ensemble import Instance, blocks, simulate_together
from verlet_numba.run.simulate import simulate
from verlet_numba.scene.build import build
from verlet_numba.scene.load import loads
from verlet_numba.scene.place import place
from verlet_numba.scene.prepare import Prepared

ROPE = worlds.FREE["bodies"][0]
SCENE = {**worlds.FREE, "time": {"duration": 1.5}, "bodies": [ROPE], "output": {"fields": ["velocity"]}}


def prepared(scene):
    loaded = loads(json.dumps({"version": 1, **scene}), "scene.yaml")
    return Prepared(loaded, place(loaded.scene, loaded.folder, loaded.source), [])


def ropes(count):
    """Ropes that differ in length, mass and gravity; the third is torn off its place at once."""
    scenes = [{**SCENE, "effects": {"gravity": [0, k, -9.81]}, "bodies": [{**ROPE, "end": [1 + 0.1 * k, 0, 3], "mass": 1 + k}]}
              for k in range(count)]
    return [torn(prepared(scene)) if k == 2 else prepared(scene) for k, scene in enumerate(scenes)]


def torn(scene):
    """The same, faster than a scene file may ask for: lost in space after 1.1 s."""
    return replace(scene, bodies=[replace(body, velocities=np.full_like(body.velocities, [0, 0, 9e29])) for body in scene.bodies])


def others():
    """What is alike with nothing else: another step; bodies that meet colliders as a whole would take long to compile."""
    return [prepared({**SCENE, "solver": {"substeps": 3}}), prepared({**SCENE, "time": {"duration": 0.2}})]


def in_order(found):
    """What became of each scene."""
    found = dict(found)
    return [found[number] for number in sorted(found)]


def digest(path):
    """Of every dataset but those that tell of time."""
    found = hashlib.sha256()
    with h5py.File(path) as file:
        def add(name, item):
            told = name.split("/")[-1] in ("start", "end", "timing", "command")
            if isinstance(item, h5py.Dataset) and not item.is_virtual and not told:
                found.update(name.encode())
                found.update(np.asarray(item[()]).tobytes() if item.dtype.kind != "O" else repr(item[()]).encode())
        file.visititems(add)
    return found.hexdigest()


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """Digests and summaries of each scene run alone."""
    folder = tmp_path_factory.mktemp("alone")
    scenes = ropes(9) + others()
    summaries = [simulate(each, folder / f"{k}.vtkhdf", quiet=True) for k, each in enumerate(scenes)]
    return [digest(folder / f"{k}.vtkhdf") for k in range(len(scenes))], summaries


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_files_are_those_of_single_runs_for_any_number_of_threads(alone, tmp_path, threads, monkeypatch):
    monkeypatch.setattr("verlet_numba.run.ensemble.BLOCK_BYTES", 4 * 1500)      # several blocks
    digests, summaries = alone
    scenes, paths = ropes(9) + others(), [tmp_path / f"{k}.vtkhdf" for k in range(11)]
    found = in_order(simulate_together(scenes, paths, threads=threads))
    assert [each for each in found if isinstance(each, Exception)] == []
    assert [digest(path) for path in paths] == digests
    for mine, single in zip(found, summaries, strict=True):
        for key in ("frames", "substeps", "status", "relaxations", "contacts", "constraint_error_max", "divergence"):
            assert getattr(mine, key) == getattr(single, key), key
    assert [each.status for each in found].count("diverged") == 1
    assert found[2].divergence.body == "line"


def test_blocks_are_settled_by_the_scenes(monkeypatch, tmp_path):
    instances = [Instance(k, each, tmp_path, "", build(each.scene, each.bodies))
                 for k, each in enumerate(ropes(5) + others() + ropes(3))]
    assert [[each.number for each in block] for block in blocks(instances)] == [[0, 1, 2, 3, 4, 7, 8, 9], [5], [6]]
    monkeypatch.setattr("verlet_numba.run.ensemble.BLOCK_BYTES", 1)
    assert all(len(block) == 1 for block in blocks(instances))


def test_a_file_that_cannot_be_made_or_written_fails_alone(tmp_path):
    paths = [tmp_path / "a.vtkhdf", tmp_path / "there.vtkhdf", tmp_path / "no" / "folder.vtkhdf", tmp_path / "d.vtkhdf"]
    paths[1].write_text("mine")
    found = in_order(simulate_together([ropes(3)[0]] * 4, paths))
    assert isinstance(found[1], FileExistsError)
    assert isinstance(found[2], OSError)
    assert found[0].status == found[3].status == "complete"
    assert digest(paths[0]) == digest(paths[3])
    assert paths[1].read_text() == "mine"


def test_what_is_stopped_keeps_its_frames(tmp_path):
    asked = []
    paths = [tmp_path / f"{k}.vtkhdf" for k in range(3)]
    found = in_order(simulate_together(ropes(4)[:2] + ropes(4)[3:], paths, stop=lambda: len(asked) > 1 or asked.append(0)))
    for summary, path in zip(found, paths, strict=True):
        assert summary.status == "stopped"
        with h5py.File(path) as file:
            assert file["provenance/status"][()] == b"stopped"
            assert 0 < len(file["particles/trajectory/position/value"]) == summary.frames < 91
