"""The comments behind the fields of buffers.py hold for built worlds: shape, kind and unit."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest
import worlds

from verlet_numba import buffers
from verlet_numba.scene.build import frames

SOURCE = Path(buffers.__file__).read_text()
COMMENT = re.compile(r"#\s+(?:\((?P<shape>[^)]*)\)\s+)?(?P<kind>real|double|int|file)\s+(?P<unit>[^;]+?)(?:;\s.+)?$")
UNIT = re.compile(r"1|SI|1?/?\(?(?:rad|kg|m|s|N)(?:\^\d)?(?:[ /]\(?(?:rad|kg|m|s|N)(?:\^\d)?\)?)*\)?")
EVERYWHERE = ("n", "N", "K", "L")           # symbols that mean the same in every structure
SCENES = {
    "everything": worlds.EVERYTHING,
    "single": worlds.with_changes(worlds.EVERYTHING, solver={"precision": "float32"}, output={"precision": "float32"}),
    "free": worlds.FREE,
    "empty": {"time": {"duration": 1}, "effects": {}},
    "meshes": worlds.with_changes(worlds.EVERYTHING, colliders=[
        {"kind": "mesh", "file": str(Path(__file__).parents[2] / "scenes/gallery/bowl.obj")}, {"kind": "plane"}]),
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
    own = {}
    for name, entry in DECLARED[type(structure).__name__].items():
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
        sizes = [size.strip() for size in shape.split(",") if size.strip()]
        assert value.ndim == len(sizes), where
        for size, length in zip(sizes, value.shape, strict=True):
            symbol, _, more = size.partition("+")
            if symbol.isdigit():
                assert length == int(symbol), where
            else:
                symbol, length = symbol.strip(), length - int(more or 0)
                known = symbols if symbol in EVERYWHERE else own
                assert known.setdefault(symbol, length) == length, f"{where}: {symbol} is {known[symbol]} elsewhere"


@pytest.mark.parametrize("name", SCENES)
def test_every_buffer_is_what_its_comment_says(name):
    model = worlds.built(SCENES[name])
    real, file = model.scene.solver.precision, model.scene.output.precision
    symbols = {"n": model.world.particles.position.shape[1], "N": model.particles}
    for path, structure in structures(model.world):
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
    seen = {type(structure).__name__ for _, structure in structures(worlds.built(worlds.EVERYTHING).world)} | {"Frames"}
    assert seen == set(DECLARED)


def test_gate_casts_once_and_copies_only_what_it_must():
    fine = np.zeros((3, 4))
    assert buffers.gate(fine, np.float64) is fine
    turned = buffers.gate(np.arange(12.0).reshape(4, 3).T, np.float32)
    assert turned.flags.c_contiguous
    assert turned.dtype == np.float32
    assert turned.flags.writeable
    assert buffers.gate(np.broadcast_to(1.0, 5), np.float64).flags.owndata
