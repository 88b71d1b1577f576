"""The comments behind the fields of buffers hold for built worlds: shape, kind and unit."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest
import worlds
from hypothesis import given, settings
from hypothesis import strategies as st

from verlet_numba import buffers
from verlet_numba.buffers.arrays import NO_ROOM, gate
from verlet_numba.kernels.narrow_beside import CHUNKS
from verlet_numba.scene import capacity
from verlet_numba.scene.build import frames
from verlet_numba.scene.capacity import roomier
from verlet_numba.study.phases import stopwatch

SOURCE = "".join(path.read_text() for path in sorted(Path(buffers.__file__).parent.glob("*.py")))
COMMENT = re.compile(r"#\s+(?:\((?P<shape>[^)]*)\)\s+)?(?P<kind>real|double|int|file)\s+(?P<unit>[^;]+?)(?:;\s.+)?$")
UNIT = re.compile(r"1|SI|1?/?\(?(?:rad|kg|m|s|N)(?:\^\d)?(?:[ /]\(?(?:rad|kg|m|s|N)(?:\^\d)?\)?)*\)?")
EVERYWHERE = ("n", "N", "K", "L")           # symbols that mean the same in every structure
TOGETHER = {"H": ("Hulls", "Search", "Meet", "Features", "Friction", "Restitution"), "E": ("Rigid", "Touches"),
            "M": ("Pairs", "Search"), "T": ("Meetings", "Manifold"), "P": ("Candidates", "Spheres")}
"""Symbols that mean the same in several structures, within one of the sets that effects come in."""
SIZE = re.compile(r"(?P<times>\d*)(?P<symbol>[A-Za-z]*)(?: \+ (?P<more>\d+))?")
SCENES = {
    "everything": worlds.EVERYTHING,
    "single": worlds.with_changes(worlds.EVERYTHING, solver={"precision": "float32"}, output={"precision": "float32"}),
    "free": worlds.FREE,
    "paper": worlds.PAPER,
    "chains": worlds.CHAINS,
    "exact": worlds.with_changes(worlds.PRECISE, effects={"friction": 0.3}),
    "step start": worlds.with_changes(worlds.EVERYTHING, solver={"gradient": "step_start"}),
    "bending": worlds.with_changes(worlds.CHAINS, effects={"bending": {"stiffness": 0.5}}),
    "empty": {"time": {"duration": 1}, "effects": {}},
    "meshes": worlds.with_changes(worlds.EVERYTHING, colliders=[
        {"kind": "mesh", "file": str(Path(__file__).parents[2] / "scenes/gallery/bowl.obj")}, {"kind": "plane"}]),
    "at rest": {"time": {"duration": 1}, "effects": {"rest": {}}, "bodies": [worlds.CRATE], "colliders": [{"kind": "plane"}]},
    "one pass": worlds.with_changes(worlds.EVERYTHING, solver={"iterations": 1, "tolerance": 0.01, "square_root": "approximate"},
                                    effects={"friction": None, "restitution": None, "gravity": None})}


def declared():
    """{structure: {field: (shape as written or None, kind) or None where the field is a structure itself}}."""
    lines, found = SOURCE.splitlines(), {}
    structures = [node for node in ast.parse(SOURCE).body if isinstance(node, ast.ClassDef)]
    names = {node.name for node in structures}
    for node in structures:
        fields = found[node.name] = {}
        for field in node.body:
            if isinstance(field, ast.AnnAssign):
                comment = COMMENT.search(lines[field.lineno - 1])
                inner = set(re.findall(r"\w+", ast.unparse(field.annotation))) & names
                assert bool(comment) != bool(inner), f"{node.name}.{ast.unparse(field.target)}: needs a comment, or a structure"
                fields[field.target.id] = comment and (comment["shape"], comment["kind"], comment["unit"])
    return found


DECLARED = declared()


def structures(value, path="world"):
    """Every structure within a world and its path."""
    yield path, value
    for name, inner in zip(value._fields, value, strict=True):
        if hasattr(inner, "_fields"):
            yield from structures(inner, f"{path}.{name}")


def hold(path, structure, real, file, symbols):
    """Check one structure; `symbols` of its own start empty, the shared ones fill up."""
    own, kind_of = {}, type(structure).__name__
    family = "soft" if "points" in path or "mixed" in path else "hard"
    for name, entry in DECLARED[kind_of].items():
        value, where = getattr(structure, name), f"{path}.{name}"
        if entry is None or value is None:
            continue
        shape, kind, _ = entry
        dtype = {"real": real, "double": np.float64, "int": np.int64, "file": file}[kind]
        if shape is None:
            assert isinstance(value, int if kind == "int" else float), where
            continue
        assert value.dtype == dtype, where
        assert value.flags.c_contiguous, where
        assert value.flags.owndata or value.base is not None, where
        sizes = [SIZE.fullmatch(size.strip()) for size in shape.split(",") if size.strip()]
        assert value.ndim == len(sizes), where
        for size, length in zip(sizes, value.shape, strict=True):
            times, symbol, more = size["times"], size["symbol"], int(size["more"] or 0)
            if not symbol:
                assert length == int(times), where
                continue
            whole, rest = divmod(length - more, int(times or 1))
            assert rest == 0, f"{where}: {length} is not {size[0]}"
            known, key = (symbols, symbol) if symbol in EVERYWHERE else (own, symbol)
            if kind_of in TOGETHER.get(symbol, ()):
                known, key = symbols, (family, symbol)
            assert known.setdefault(key, whole) == whole, f"{where}: {symbol} is {known[key]} elsewhere"


def asked_for(model):
    """A model's world with what a command calls for and no scene: a stopwatch, and several threads."""
    world, meet = model.world, model.world.effects.meet
    if meet is not None:
        meet = meet._replace(beside=capacity.beside_of(meet.narrow, CHUNKS))
    return world._replace(effects=world.effects._replace(meet=meet), stopwatch=stopwatch(1, 7))


@pytest.mark.parametrize("name", SCENES)
def test_every_buffer_is_what_its_comment_says(name):
    model = worlds.built(SCENES[name])
    real, file = model.scene.solver.precision, model.scene.output.precision
    symbols = {"n": model.world.particles.position.shape[1], "N": model.particles}
    for path, structure in structures(asked_for(model)):
        hold(path, structure, np.dtype(real), np.dtype(file), symbols)
    hold("frames", frames(model, 5), np.dtype(real), np.dtype(file), symbols)


@pytest.mark.parametrize("softness", ["runs", "sticks"])
def test_softness_has_an_entry_for_every_constraint(softness):
    world = worlds.built(worlds.EVERYTHING).world
    assert getattr(world, f"{softness}_softness").share.shape == getattr(world, softness).rest.shape


def test_units_are_those_of_the_si():
    for structure, fields in DECLARED.items():
        for field, entry in fields.items():
            assert entry is None or UNIT.fullmatch(entry[2]), f"{structure}.{field}: unit {entry[2]}"


def test_scenes_have_every_structure():
    """Else the comments of the others are not looked at."""
    seen = {type(structure).__name__ for scene in SCENES.values()
            for _, structure in structures(asked_for(worlds.built(scene)))} | {"Frames"}
    assert seen == set(DECLARED)


LISTS = {"contact": lambda e: (e.contact.listed, e.contact.particle), "pairs": lambda e: (e.meet.spare.listed, e.meet.pairs.first),
         "meetings": lambda e: (e.meet.meetings.listed, e.meet.meetings.pair),
         "spheres": lambda e: (e.spheres.candidates.listed, e.spheres.push),
         "candidates": lambda e: (e.mixed.candidates.listed, e.mixed.pairs.first),
         "mixed": lambda e: (e.mixed.meetings.listed, e.mixed.meetings.pair)}


@given(st.lists(st.sampled_from(sorted(LISTS)), max_size=12))
@settings(max_examples=20, deadline=None)
def test_only_lists_that_lack_room_grow_and_touches_with_them(short):
    """Kernels do not check bounds: one more would be written beyond the arrays."""
    effects = worlds.built(worlds.EVERYTHING).world.effects
    before = {name: of(effects)[1].size for name, of in LISTS.items()}
    for name in short:
        LISTS[name](effects)[0][0] = NO_ROOM
        effects = roomier(effects)
    assert {name: of(effects)[1].size for name, of in LISTS.items()} == {
        name: size * 2**short.count(name) for name, size in before.items()}
    room = sum(LISTS[name](effects)[1].size for name in ("contact", "meetings", "mixed"))
    assert effects.touches.first.size >= room
    assert effects.rigid.size.size >= effects.rigid.bodies + room + 1
    assert effects.meet.spare.first.size == effects.meet.search.code.size == effects.meet.pairs.first.size
    assert effects.mixed.spare.first.size == effects.mixed.candidates.first.size == effects.mixed.pairs.first.size
    assert effects.meet.manifold.points.size >= effects.meet.meetings.pair.size
    assert effects.restitution.rebound.size >= effects.contact.particle.size


def test_pairs_beyond_all_bounds_are_refused(monkeypatch):
    effects = worlds.built(worlds.EVERYTHING).world.effects
    monkeypatch.setattr(capacity, "MOST_PAIRS", 100)
    while effects.meet.spare.first.size <= 100 + capacity.PAIRS_A_HULL * effects.meet.still.size:
        effects.meet.spare.listed[0] = NO_ROOM
        effects = roomier(effects)
    effects.meet.spare.listed[0] = NO_ROOM
    with pytest.raises(capacity.CrowdedError, match="stand in each other"):
        roomier(effects)


def test_gate_casts_once_and_copies_only_what_it_must():
    fine = np.zeros((3, 4))
    assert gate(fine, np.float64) is fine
    turned = gate(np.arange(12.0).reshape(4, 3).T, np.float32)
    assert turned.flags.c_contiguous
    assert turned.dtype == np.float32
    assert turned.flags.writeable
    assert gate(np.broadcast_to(1.0, 5), np.float64).flags.owndata
