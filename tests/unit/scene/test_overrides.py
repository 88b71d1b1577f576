"""`--set PATH=VALUE`."""

import pytest

from verlet_numba.scene.load import loads
from verlet_numba.scene.problems import Problem, SceneError
from verlet_numba.scene.schema import Scene

TEXT = """\
version: 1
time: {duration: 1}
bodies:
  - {kind: box, name: crate, size: [1, 1, 1], mass: 1}
  - {kind: icosahedron, radius: 1, mass: 1}
colliders:
  - {kind: sphere, radius: 0.3}
"""


def scene(*sets: str, text: str = TEXT) -> Scene:
    return loads(text, "s.yaml", sets).scene


def refused(*sets: str, text: str = TEXT) -> list[Problem]:
    with pytest.raises(SceneError) as caught:
        loads(text, "s.yaml", sets)
    return caught.value.problems


def test_paths_go_by_name_and_index() -> None:
    assert scene("bodies.crate.mass=2").bodies[0].mass == 2
    assert scene("bodies.0.mass=2").bodies[0].mass == 2
    assert scene("bodies.icosahedron_1.mass=2").bodies[1].mass == 2
    assert scene("colliders.0.radius=2").colliders[0].radius == 2
    assert scene("colliders.sphere_0.radius=2").colliders[0].radius == 2
    assert scene("bodies.crate.size.1=2").bodies[0].size == (1, 2, 1)


def test_values_are_yaml() -> None:
    assert scene("time.duration=1e-3").time.duration == 1e-3
    assert scene("effects.gravity=[0, 0, -1.6]").effects.gravity == (0, 0, -1.6)
    assert scene("name=a=b").name == "a=b"
    assert scene("bodies.crate.mass=null", "bodies.crate.density=3").bodies[0].density == 3
    assert scene("colliders=[]").colliders == ()


def test_mappings_that_are_not_there_are_made() -> None:
    effects = scene("effects.friction.static=0.3", "effects.friction.dynamic=0.2").effects
    assert effects.friction.model_dump() == {"static": 0.3, "dynamic": 0.2}
    assert scene("solver.substeps=3", text=TEXT + "solver:\n").solver.substeps == 3


def test_effects_that_are_made_keep_the_gravity_that_stands_where_there_are_none() -> None:
    assert scene("effects.friction=0.3").effects.gravity == scene().effects.gravity == (0, 0, -9.81)
    assert scene("effects.damping=1", "effects.gravity=null").effects.gravity is None
    assert scene("effects={damping: 1}").effects.gravity is None
    assert scene("effects.damping=1", text=TEXT + "effects: {}").effects.gravity is None


def test_later_ones_win() -> None:
    assert scene("seed=1", "seed=2").seed == 2
    assert scene("solver.substeps=3", "solver={iterations: 2}").solver.substeps == 8


def test_an_override_reaches_one_use_of_an_alias_alone() -> None:
    text = TEXT.replace("size: [1, 1, 1]", "size: &s [1, 1, 1]") + "  - {kind: box, size: *s}\n"
    changed = scene("bodies.crate.size.0=5", text=text)
    assert changed.bodies[0].size == (5, 1, 1)
    assert changed.colliders[1].size == (1, 1, 1)


@pytest.mark.parametrize(("argument", "column", "path", "words"), [
    ("bodies.crate.mass=-1", 19, "bodies.0.mass", "above 0"),
    ("bodies.crate.mas=1", 14, "bodies.0.mas", "did you mean 'mass'?"),
    ("bodies.crat.mass=1", 8, "bodies.crat", "did you mean 'crate'?"),
    ("bodies.2.mass=1", 8, "bodies.2", "the list has 2"),
    ("bodies.99999999999.mass=1", 8, "bodies.99999999999", "the list has 2"),
    ("bodies.-1.mass=1", 8, "bodies.-1", "no such entry"),
    ("time.duration.x=1", 15, "time.duration.x", "single value"),
    ("efects.friction.static=1", 1, "efects", "did you mean 'effects'?"),
    ("effects.drag.liner=1", 14, "effects.drag.liner", "did you mean 'linear'?"),
    ("effects.wind.density=1", 14, "effects.wind.velocity", "missing"),
    ("solver={substeps: 0}", 19, "solver.substeps", "at least 1"),
    ("seed=.nan", 6, "seed", "finite"),
    ("effects.drag.linear=!!int 3", 21, "effects.drag.linear", "tags"),
    ("solver=[1", 10, "", "not YAML"),
    ("seed", 1, "", "PATH=VALUE"), ("seed=", 1, "", "PATH=VALUE"), ("=1", 1, "", "PATH=VALUE"),
    ("solver..substeps=1", 1, "", "PATH=VALUE")])
def test_problems_point_at_the_argument(argument: str, column: int, path: str, words: str) -> None:
    problem, = refused(argument)
    assert (problem.file, problem.line, problem.column) == (f"--set {argument}", 1, column)
    assert problem.path == path
    assert words in problem.message


def test_an_argument_stays_on_one_line() -> None:
    assert str(refused("seed=\ud800")[0]) == "--set 'seed=\\ud800':1:6: this character is not valid Unicode"
    assert "\n" not in str(refused("seed=-1\n")[0])


def test_problems_of_the_file_still_point_at_the_file() -> None:
    text = TEXT.replace("radius: 0.3", "radius: -0.3")
    found = refused("bodies.crate.mass=-1", text=text)
    assert [(problem.file, problem.line) for problem in found] == [("s.yaml", 7), ("--set bodies.crate.mass=-1", 1)]


def test_an_override_mends_the_file() -> None:
    text = TEXT.replace("radius: 0.3", "radius: -0.3")
    assert scene("colliders.0.radius=1", text=text).colliders[0].radius == 1
