"""Rigid bodies from mesh files: what is read, what is refused and how it is named."""

import sys

import numpy as np
import pytest
import trimesh

from verlet_numba.scene import hulls, rigidity
from verlet_numba.scene.mesh import mesh, tetrahedral_sticks, volume
from verlet_numba.scene.shapes import ShapeError

SOLIDS = {
    "cube": trimesh.creation.box(),
    "pancake": trimesh.creation.box((1, 1, 1e-3)),
    "tessellated cube": trimesh.creation.box().subdivide().subdivide(),
    "sphere": trimesh.creation.icosphere(2),
    "prism": trimesh.creation.cylinder(1, 3, sections=32),
}
# An L of two arms: a hexagon in the plane, of which corner 0 sees all others, and its copy above.
_HEXAGON = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
NOT_CONVEX = {
    "L": trimesh.Trimesh(
        [(x, y, z) for z in (0, 1) for x, y in _HEXAGON],
        [*([0, k + 1, k] for k in range(1, 5)), *([6, k + 6, k + 7] for k in range(1, 5)),
         *([k, (k + 1) % 6, (k + 1) % 6 + 6] for k in range(6)), *([k, (k + 1) % 6 + 6, k + 6] for k in range(6))]),
    "torus": trimesh.creation.torus(1, 0.4, major_sections=9, minor_sections=6),
    "tube": trimesh.creation.annulus(0.6, 1, 1, sections=10),
    "two boxes": trimesh.util.concatenate([trimesh.creation.box(), trimesh.creation.box().apply_translation([3, 0, 0])]),
}
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


@pytest.fixture
def written(tmp_path):
    def write(content, name="solid.obj"):
        path = tmp_path / name
        if isinstance(content, str | bytes):
            path.write_bytes(content.encode() if isinstance(content, str) else content)
        else:
            content.export(path)
        return path
    return write


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("suffix", ["obj", "stl", "ply", "off"])
def test_convex_solids_become_rigid(written, name, suffix):
    solid = SOLIDS[name]
    shape = mesh(written(solid, f"solid.{suffix}"), density=2.0)
    assert len(shape.positions) == len(solid.vertices)
    assert len(shape.triangles) == len(solid.faces)
    assert rigidity.is_rigid(shape.positions, shape.sticks)
    assert len(np.unique(np.sort(shape.sticks, axis=1), axis=0)) == len(shape.sticks)
    assert (shape.lengths > 0).all()
    assert shape.masses.sum() == pytest.approx(2 * solid.volume, rel=1e-6)


def test_large_cospherical_mesh_is_rigid(written, monkeypatch):
    monkeypatch.setattr(rigidity, "DENSE_LIMIT", 100)
    shape = mesh(written(trimesh.creation.icosphere(2)), mass=1)
    assert len(shape.positions) == 162
    assert rigidity.is_rigid(shape.positions, shape.sticks)


def test_sticks_of_a_cube_hold_its_edges_and_no_flat_tetrahedron():
    corners = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    surface = trimesh.convex.convex_hull(corners)
    sticks = tetrahedral_sticks(np.array(surface.vertices), np.array(surface.faces))
    assert 18 <= len(sticks) <= 22


def test_scale_and_origin_of_the_file(written):
    shape = mesh(written(TETRAHEDRON), scale=2.0, mass=4.0)
    np.testing.assert_array_equal(shape.positions, [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2]])
    np.testing.assert_array_equal(shape.masses, [1] * 4)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_nothing_depends_on_the_scale(written, scale):
    solid = SOLIDS["sphere"].copy()
    solid.apply_scale(scale)
    shape = mesh(written(solid, "solid.stl"), mass=1)
    assert len(shape.positions) == 162


def test_surface_that_points_inwards_is_turned(written):
    inverted = trimesh.creation.box()
    inverted.invert()
    shape = mesh(written(inverted), mass=1)
    assert volume(shape.positions, shape.triangles) == pytest.approx(1)


@pytest.mark.parametrize(("text", "message"), [
    (TETRAHEDRON.replace("f 2 3 4\n", ""), r"triangle 0 .* open side"),
    (TETRAHEDRON.replace("f 2 3 4", "f 2 4 3"), r"triangle 0 .* wound against"),
    (TETRAHEDRON + "f 1 1 2\n", r"triangle 4 .* no area"),
    (TETRAHEDRON + "v .5 0 0\nf 1 2 5\n", r"triangle 4 .* no area"),
    (TETRAHEDRON + "v 0 -1 0\nv 0 0 -1\nf 1 2 5\nf 1 5 6\nf 2 6 5\nf 1 6 2\n", r"triangle 0 .* more than one other"),
    (TETRAHEDRON + "f 1 2 9\n", "not a readable mesh"),
    ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n", r"triangle 0 .* twice"),
    ("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\nf 1 3 4\nf 1 4 2\n", "no volume"),
    ("hello", "not a readable mesh|no triangles"),
    ("", "not a readable mesh|no triangles"),
])
def test_broken_surfaces_are_refused_by_name(written, text, message):
    with pytest.raises(ShapeError, match=message):
        mesh(written(text), mass=1)


@pytest.mark.parametrize("again", ["f 3 1 4", "f 1 4 3", "f 4 3 1"])
def test_repeated_triangles_count_once_and_are_told(written, again):
    once = mesh(written(TETRAHEDRON), density=1)
    shape = mesh(written(TETRAHEDRON + f"{again}\n{again}\n"), density=1)
    assert len(shape.notes) == 1
    assert shape.notes[0].startswith("triangle 4 (counted from 0) is in the file twice")
    assert "(and 1 more)" in shape.notes[0]
    np.testing.assert_array_equal(shape.sticks, once.sticks)
    np.testing.assert_array_equal(shape.masses, once.masses)
    assert len(shape.triangles) == 4


def test_faults_behind_repeated_triangles_keep_their_numbers(written):
    text = TETRAHEDRON.replace("f 1 3 2", "f 1 3 2\nf 1 3 2") + "v 5 0 0\nv 6 0 0\nv 5 1 0\nf 5 6 7\n"
    with pytest.raises(ShapeError, match=r"triangle 5 .* open side"):
        mesh(written(text), mass=1)


def test_surfaces_that_touch_in_a_point_are_refused(written):
    with pytest.raises(ShapeError, match=r"triangle 0 .* meets itself in a point"):
        mesh(written(TETRAHEDRON + "v -1 0 0\nv 0 -1 0\nv 0 0 -1\nf 1 5 6\nf 1 6 7\nf 1 7 5\nf 5 7 6\n"), mass=1)


def test_surfaces_that_cross_are_refused(written):
    two = trimesh.util.concatenate([trimesh.creation.box(), trimesh.creation.box().apply_translation([.3, .4, .5])])
    with pytest.raises(ShapeError, match=r"triangle \d+ .* is crossed by another"):
        mesh(written(two), mass=1)


@pytest.mark.parametrize("name", NOT_CONVEX)
@pytest.mark.parametrize("scale", [1, 1e-6, 1e6])
def test_what_is_not_convex_becomes_rigid(written, name, scale):
    solid = NOT_CONVEX[name]
    shape = mesh(written(solid, "solid.ply"), scale=scale, density=2.0)
    vertices = len(solid.vertices)
    np.testing.assert_allclose(shape.positions[:vertices], solid.vertices * scale, rtol=1e-6, atol=1e-6 * scale)
    assert (shape.triangles < vertices).all()
    assert rigidity.is_rigid(shape.positions, shape.sticks)
    assert (shape.lengths > 1e-4 * scale).all()
    assert shape.masses.sum() == pytest.approx(2 * solid.volume * scale**3, rel=1e-6)
    assert ["braced by 6 sticks" in note for note in shape.notes[1:]] == [True] * (name == "two boxes")
    assert f"is not convex: it meets others as {len(shape.parts)} convex parts" in shape.notes[0]


def test_sticks_of_what_is_not_convex_stay_within_it(written):
    """Of the L's twelve vertices, none of one arm's end is joined to one of the other's across the notch."""
    shape = mesh(written(NOT_CONVEX["L"], "solid.ply"), mass=1)
    middle = shape.positions[shape.sticks].mean(axis=1)
    assert not ((middle[:, 0] > 1.01) & (middle[:, 1] > 1.01)).any()


def test_what_is_not_convex_needs_the_extra(written, monkeypatch):
    monkeypatch.setitem(sys.modules, "coacd", None)
    hulls._cut.cache_clear()
    with pytest.raises(ShapeError, match=r'pip install "verlet-numba\[mesh\]"') as error:
        mesh(written(NOT_CONVEX["L"]), mass=1)
    assert error.value.key == "file"


@pytest.mark.parametrize("content", [b"\0" * 50, b"\xff" * 200, b"solid x\nfacet"])
def test_damaged_stl_is_refused(written, content):
    with pytest.raises(ShapeError):
        mesh(written(content, "solid.stl"), mass=1)


def test_missing_file_and_foreign_format_are_named(tmp_path):
    with pytest.raises(ShapeError, match=r"gone\.obj: no such file"):
        mesh(tmp_path / "gone.obj", mass=1)
    with pytest.raises(ShapeError, match=r"notes\.txt: not a mesh format"):
        mesh(tmp_path / "notes.txt", mass=1)
