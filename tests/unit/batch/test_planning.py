"""Sweeps as users write them, and the runs that they come to."""

import json
from pathlib import Path

import pytest

from verlet_numba.batch.document import read_document
from verlet_numba.batch.planning import plan
from verlet_numba.batch.sweep import batches_of, shard_of
from verlet_numba.scene.load import load, resolved
from verlet_numba.scene.problems import Problem, SceneError

SCENE = """\
version: 1
time: {duration: 0.1}
effects: {gravity: [0, 0, -9.81]}
bodies:
  - {kind: box, name: crate, size: [1, 1, 1], mass: 1, position: [0, 0, 2]}
  - {kind: rope, name: line, start: [0, 5, 1], end: [1, 5, 1], segments: 4, mass: 1}
"""
SWEEP = """\
version: 1
scene: scene.yaml
method: grid
parameters:
  bodies.crate.mass: {values: [0.5, 1, 2]}
  effects.damping: [0, 0.1]
measures: [speed_max, total_energy.least]
"""


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    return tmp_path / "scene.yaml"


def runs_of(file: Path, *vary: str, sets: tuple[str, ...] = (), **options):
    return plan(read_document(file, vary, sets, options))


def refused(file: Path, *vary: str, sets: tuple[str, ...] = (), **options) -> list[Problem]:
    with pytest.raises(SceneError) as caught:
        runs_of(file, *vary, sets=sets, **options)
    return caught.value.problems


def written(scene: Path, text: str) -> Path:
    file = scene.with_name("sweep.yaml")
    file.write_text(text, encoding="utf-8")
    return file


def test_a_sweep_file_and_options_say_the_same(scene):
    by_file = runs_of(written(scene, SWEEP))
    by_options = runs_of(scene, "bodies.crate.mass=0.5,1,2", "effects.damping=0,0.1", measures=["speed_max", "total_energy.least"])
    assert by_file.runs == by_options.runs
    assert [run.values for run in by_file.runs] == [(m, d) for m in (0.5, 1, 2) for d in (0, 0.1)]
    assert by_file.document.sweep.measures == by_options.document.sweep.measures == ("speed_max", "total_energy.least")


def test_options_go_over_the_file(scene):
    found = runs_of(written(scene, SWEEP), "bodies.crate.mass=3", "solver.substeps=2,4", method="grid", measures=["contacts"])
    assert found.parameters == ["bodies.crate.mass", "effects.damping", "solver.substeps"]
    assert [run.values for run in found.runs] == [(3, d, s) for d in (0, 0.1) for s in (2, 4)]


def test_a_run_is_the_scene_under_its_overrides(scene):
    found = runs_of(scene, "bodies.crate.mass=2,3", "bodies.line.end=[1, 5, 1],[1.5, 5, 1]", sets=("solver.substeps=3",))
    for run in found.runs:
        alone = load(scene, ["solver.substeps=3", *found.overrides(run)]).scene
        assert (alone.bodies[0].mass, list(alone.bodies[1].end)) == run.values
        assert alone.solver.substeps == 3


def test_equal_scenes_are_one_run(scene):
    found = runs_of(scene, "bodies.crate.mass=1,1.0,2", "bodies.0.mass=1,2")
    assert found.points == 6
    assert len(found.runs) == len({run.id for run in found.runs}) == 2


def test_ids_depend_on_nothing_but_the_scene(scene, tmp_path):
    [run] = runs_of(scene, "bodies.crate.mass=1").runs
    other = tmp_path / "other.yaml"
    other.write_text("# the same\n" + SCENE.replace("mass: 1, position", "position").replace("kind: box", "mass: 7, kind: box"),
                     encoding="utf-8")
    assert runs_of(other, "bodies.0.mass=1").runs[0].id == run.id
    assert runs_of(other, "bodies.0.mass=2").runs[0].id != run.id
    assert resolved(load(scene).scene) == resolved(load(other, ["bodies.0.mass=1"]).scene)


def test_a_mesh_file_is_part_of_the_run(tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text(json.dumps({"version": 1, "time": {"duration": 1}, "colliders": [{"kind": "mesh", "file": "floor.obj"}]}))
    assert "there is no file" in refused(scene, "seed=1")[0].message
    ids = set()
    for text in ("v 0 0 0\n", "v 0 0 1\n"):
        (tmp_path / "floor.obj").write_text(text)
        ids.add(runs_of(scene, "seed=1").runs[0].id)
    assert len(ids) == 2


def test_runs_that_differ_in_numbers_alone_are_one_group(scene):
    def groups(*vary, **options):
        return len({run.group for run in runs_of(scene, *vary, **options).runs})

    assert groups("bodies.crate.mass=1,2", "bodies.crate.position=[0, 0, 1],[0, 1, 2]", "effects.gravity=[0, 0, 0],[0, 0, -1]",
                  "seed=1,2", "effects.damping=0.1,0.2") == 1
    assert groups("effects.damping=0,0.1") == 2
    assert groups("bodies.line.segments=4,5") == 2
    assert groups("solver.substeps=4,5") == 2
    assert groups("time.duration=0.1,0.2") == 2


def test_ranges_over_whole_numbers_are_drawn_in_whole_numbers(scene):
    found = runs_of(scene, "solver.substeps=2:40", "bodies.crate.mass=1:5", samples=12, method="sobol")
    assert all(isinstance(substeps, int) and 2 <= substeps <= 40 for substeps, _ in (run.values for run in found.runs))
    assert any(mass != int(mass) for _, mass in (run.values for run in found.runs))
    assert "whole number" in refused(scene, "solver.substeps=2.5:40", samples=3)[0].message


def test_shards_are_the_whole_sweep_each_run_once(scene):
    found = runs_of(scene, "bodies.crate.mass=1:2", samples=10)
    shards = [shard_of(found, part, 4) for part in (1, 2, 3, 4)]
    assert sorted(run.id for shard in shards for run in shard) == sorted(run.id for run in found.runs)
    assert [len(shard) for shard in shards] == [3, 3, 2, 2]


def test_batches_hold_every_run_once_and_one_group_each(scene, tmp_path):
    found = runs_of(scene, "bodies.crate.mass=1:2", "solver.substeps=2,3", samples=50)
    group = {run.id: run.group for run in found.runs}
    batches = [batch for part in batches_of(found, tmp_path, found.runs, 2) for batch in part]
    assert sorted(key for batch in batches for key in batch.keys) == sorted(group)
    assert all(len({group[key] for key in batch.keys}) == 1 for batch in batches)
    assert len(batches) >= 8


@pytest.mark.parametrize(("old", "new", "line", "column", "path", "words"), [
    ("scene.yaml", "gone.yaml", 2, 8, "scene", "cannot be read"),
    ("method: grid", "method: grit", 3, 9, "method", "'grit' is not one of grid, zip, random, lhs, sobol"),
    ("method: grid", "metod: grid", 3, 1, "metod", "did you mean 'method'?"),
    ("method: grid", "method: lhs", 5, 3, "parameters", "needs `samples`"),
    ("method: grid", "method: zip", 6, 20, "parameters.effects.damping", "has 2 values where others have 3"),
    ("speed_max", "sped_max", 7, 12, "measures.0", "did you mean 'speed_max'?"),
    ("total_energy.least", "total_energy.lest", 7, 23, "measures.1", "may be followed by .first"),
    ("values: [0.5", "value: [0.5", 5, 23, "parameters.bodies.crate.mass.value", "did you mean 'values'?"),
    ("{values: [0.5, 1, 2]}", "{min: 2}", 5, 22, "parameters.bodies.crate.mass", "a range needs `min` and `max`"),
    ("{values: [0.5, 1, 2]}", "{min: 2, max: 1}", 5, 36, "parameters.bodies.crate.mass.max", "not above the lower end"),
    ("[0, 0.1]", "{min: 0, max: 1, distribution: log_uniform}", 6, 26, "parameters.effects.damping.min", "above 0"),
    ("[0, 0.1]", "{min: 0, max: 1}", 6, 20, "parameters.effects.damping", "needs `samples`"),
    ("[0.5, 1, 2]", "[0.5, -1, 2]", 5, 37, "bodies.0.mass", "must be above 0"),
    ("bodies.crate.mass", "bodies.crat.mass", 5, 10, "bodies.crat", "did you mean 'crate'?"),
    ("effects.damping", "effects.dampin", 6, 11, "effects.dampin", "did you mean 'damping'?"),
    ("version: 1", "version: 2", 1, 10, "version", "must be 1"),
])
def test_mistakes_are_told_where_they_stand(scene, old, new, line, column, path, words):
    text = SWEEP.replace(old, new, 1)
    assert text != SWEEP
    file = written(scene, text)
    first = refused(file)[0]
    assert (first.file, first.line, first.column, first.path) == (str(file), line, column, path), first
    assert words in first.message


@pytest.mark.parametrize(("vary", "column", "words"), [
    ("bodies.crate.mass", 1, "write PATH=SPEC"),
    ("bodies.crate.mass=1,-2", 21, "must be above 0"),
    ("bodies.crate.mass=1:2:lin", 23, "a range is MIN:MAX or MIN:MAX:log"),
    ("bodies.crate.mass=2:1", 21, "not above the lower end"),
    ("bodies.crate.mass=-1:1", 19, "must be above 0"),
    ("bodies.crate.mas=1,2", 14, "did you mean 'mass'?"),
    ("bodies.crate.mass=[1", 22, "not YAML"),
])
def test_mistakes_of_options_are_told_within_them(scene, vary, column, words):
    first = refused(scene, vary, samples=4)[0]
    assert (first.file, first.line, first.column) == (f"--vary {vary}", 1, column), first
    assert words in first.message


def test_a_sweep_needs_parameters(scene):
    assert "nothing is varied" in refused(scene)[0].message
    assert "mass" in refused(scene, "seed=1,2", sets=("bodies.0.mass=-1",))[0].path


@pytest.mark.parametrize("file", sorted((Path(__file__).parents[3] / "scenes/sweeps").glob("*.yaml")), ids=lambda file: file.stem)
def test_the_sweeps_of_the_repository_are_good(file):
    found = runs_of(file)
    assert len(found.runs) == found.points > 20
