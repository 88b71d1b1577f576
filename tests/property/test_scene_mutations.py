"""A damaged scene text either loads or is refused with positions; nothing else ever comes out."""

import random
from collections.abc import Callable
from pathlib import Path

import pytest

from verlet_numba.scene.load import load
from verlet_numba.scene.problems import SceneError

SCENE = b"""\
version: 1
name: mixed
time: {duration: 2.0, frame_rate: 60}
solver: {preset: default, substeps: 8, tolerance: 1e-3, order: lines}
effects:
  gravity: [0, 0, -9.81]
  drag: {linear: 0.1}
  friction: &rubber {static: 0.5, dynamic: 0.4}
  restitution: 0.0
bodies:
  - {kind: cloth, name: sheet, size: [1, 1], resolution: [4, 4], mass: 0.2, position: [0, 0, 0.8], pinned: corners}
  - {kind: rope, name: line, start: [-1, 0, 1], end: [1, 0, 1], length: 2.2, segments: 5, mass: 0.5, pinned: [0, 5]}
  - {kind: box, size: [0.4, 0.4, 0.4], density: 1e3, rotation: {axis: [0, 0, 1], degrees: 30}, friction: *rubber}
  - {kind: icosahedron, radius: 0.2, mass: 1.0, count: 5, scatter: {inside: [[-2, -2, 0.3], [2, 2, 3]], speed: [0, 4]}}
  - kind: particles
    name: "pendulum"
    positions: [[0, 0, 0], [1, 0, 0], [2, 0, 0]]
    masses: [1, 1, 1]
    pinned: [0]
    sticks: [[0, 1], [1, 2, 0.5]]
    angles: [[0, 1, 2, 90]]
attachments: [[sheet, 0, line, 3]]
colliders:
  - {kind: plane}
  - {kind: sphere, radius: 0.3, path: [[0, 0, 0, 0], [1, 1, 0, 0]], spin: {axis: [0, 0, 1], rate: 2}}
output: {fields: [velocity]}
expect: [{measure: speed_max, max: 3, from: 0.5}]
"""
VALUES = [b"0", b"-1", b"1e400", b".nan", b"null", b"~", b"true", b"[]", b"{}", b"''", b"no", b"[[1, 2], [3]]",
          b"*rubber", b"!!int 3", b"99999999999999999999", b"0x10", b"{kind: box}", b"\xff", b"\xf0\x9f\x98\x80",
          b"&rubber 1", b"|", b"- 1"]
Mutation = Callable[[bytearray, random.Random], None]


def flip_bits(text: bytearray, dice: random.Random) -> None:
    for _ in range(dice.randint(1, 4)):
        text[dice.randrange(len(text))] ^= 1 << dice.randrange(8)


def truncate(text: bytearray, dice: random.Random) -> None:
    del text[dice.randrange(len(text)):]


def lines(change: Callable[[list[bytes], random.Random], None]) -> Mutation:
    def mutate(text: bytearray, dice: random.Random) -> None:
        rows = bytes(text).split(b"\n")
        change(rows, dice)
        text[:] = b"\n".join(rows)
    return mutate


def delete(rows: list[bytes], dice: random.Random) -> None:
    del rows[dice.randrange(len(rows))]


def duplicate(rows: list[bytes], dice: random.Random) -> None:
    rows.insert(dice.randrange(len(rows)), dice.choice(rows))


def indent(rows: list[bytes], dice: random.Random) -> None:
    rows[dice.randrange(len(rows))] = dice.choice([b" ", b"\t", b"- ", b"? "]) + dice.choice(rows)


def tokens(change: Callable[[list[bytes], list[int], random.Random], None]) -> Mutation:
    def mutate(text: bytearray, dice: random.Random) -> None:
        words = bytes(text).replace(b"[", b"\0[\0").replace(b"{", b"\0{\0").replace(b", ", b"\0, \0").replace(
            b"]", b"\0]\0").replace(b"}", b"\0}\0").replace(b": ", b"\0: \0").split(b"\0")
        change(words, [number for number, word in enumerate(words) if word.strip(b" ,:[]{}\n")], dice)
        text[:] = b"".join(words)
    return mutate


def replace_value(words: list[bytes], places: list[int], dice: random.Random) -> None:
    words[dice.choice(places)] = dice.choice(VALUES)


def swap_values(words: list[bytes], places: list[int], dice: random.Random) -> None:
    one, other = dice.choice(places), dice.choice(places)
    words[one], words[other] = words[other], words[one]


def rename(words: list[bytes], places: list[int], dice: random.Random) -> None:
    words[dice.choice(places)] += dice.choice([b"x", b"_", b"s", b"<<"])


MUTATIONS: list[Mutation] = [flip_bits, truncate, lines(delete), lines(duplicate), lines(indent), tokens(replace_value),
                             tokens(swap_values), tokens(rename)]


def outcome(path: Path, sets: list[str]) -> bool:
    """Whether the scene loads; if not, its problems must have a place and words."""
    try:
        load(path, sets)
    except SceneError as error:
        problems = error.problems
    else:
        return True
    assert problems
    for problem in problems:
        assert problem.line >= 1
        assert problem.column >= 1
        assert problem.message
        assert "\n" not in str(problem)
    return False


@pytest.mark.parametrize("seed", range(8))
def test_mutated_scenes_load_or_are_refused(seed: int, tmp_path: Path) -> None:
    dice = random.Random(seed)
    path = tmp_path / "scene.yaml"
    path.write_bytes(SCENE)
    assert outcome(path, [])
    results = []
    for _ in range(60):
        text = bytearray(SCENE)
        for _ in range(dice.randint(1, 2)):
            if text:
                dice.choice(MUTATIONS)(text, dice)
        path.write_bytes(text)
        results.append(outcome(path, []))
    assert not all(results)


def test_mutated_overrides_load_or_are_refused(tmp_path: Path) -> None:
    dice = random.Random(1)
    path = tmp_path / "scene.yaml"
    path.write_bytes(SCENE)
    paths = ["bodies.sheet.mass", "bodies.0", "bodies.1.pinned", "bodies.pendulum.sticks.0.2", "bodies", "seed",
             "expect", "effects.friction.static", "effects.drag", "effects.wind.velocity", "solver.order",
             "colliders.1.path.0", "colliders.plane_0.normal", "time", "time.duration", "attachments.0", "x.y.z",
             "bodies.9", "name.x", "a..b"]
    results = []
    for _ in range(300):
        value = dice.choice(VALUES).decode("utf-8", "surrogateescape")
        results.append(outcome(path, [f"{dice.choice(paths)}={value}"]))
    assert any(results)
    assert not all(results)
