"""Other formats, read back by readers that are not ours: trimesh, USD's own library, PC2's published header."""

import struct

import numpy as np
import pytest
from trajectories import FRAMES, variety, write

from verlet_numba.study import reader
from verlet_numba.study.export import ExportError, export


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory):
    return variety(tmp_path_factory.mktemp("export") / "variety.vtkhdf")


@pytest.fixture(scope="module")
def run(trajectory):
    with reader.open(trajectory) as opened:
        yield opened


def test_obj_is_a_numbered_file_a_frame(trajectory, run, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    found = export(trajectory, tmp_path / "a.obj")
    assert [file.name for file in found] == [f"a_{k:04d}.obj" for k in range(31)]
    scene = trimesh.load_scene(found[7], process=False, split_objects=True, group_material=False, maintain_order=True)
    corners = sorted(mesh.vertices[mesh.faces].tolist() for mesh in scene.geometry.values() if hasattr(mesh, "faces"))
    bodies = [run.body(name) for name in ("sheet", "crate.0", "crate.1")]
    expected = sorted(body.positions(7)[body.triangles].tolist() for body in bodies)
    for one, other in zip(corners, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-7)
    lines = found[7].read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if line[0] == "o"] == ["o sheet", "o line", "o crate.0", "o crate.1", "o dots"]
    assert [line for line in lines if line[0] in "lp"] == ["l 13 14 15 16 17 18", "l 35 36", "p 37"]
    points = np.array([line.split()[1:] for line in lines if line[:2] == "v "], "f4")
    np.testing.assert_array_equal(points, run.positions(7))


def test_ply_has_bodies_colours_faces_and_edges(trajectory, run, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    found = export(trajectory, tmp_path / "a.ply", [0, 30])
    assert [file.name for file in found] == ["a_0000.ply", "a_0030.ply"]
    mesh = trimesh.load(found[1], process=False)
    np.testing.assert_array_equal(mesh.vertices, run.positions(30))
    np.testing.assert_array_equal(mesh.faces, run.triangles)
    raw = mesh.metadata["_ply_raw"]
    assert raw["vertex"]["data"]["body"].ravel().tolist() == [0] * 12 + [1] * 6 + [2] * 8 + [3] * 8 + [4] * 3
    edges = np.stack([raw["edge"]["data"][f"vertex{end}"].ravel() for end in (1, 2)], 1)
    assert edges.tolist() == [[k, k + 1] for k in range(12, 17)] + [[34, 35]]


def test_pc2_is_what_its_header_says(trajectory, run, tmp_path):
    export(trajectory, tmp_path / "a.pc2", [slice(4, 31, 3)])
    data = (tmp_path / "a.pc2").read_bytes()
    assert struct.unpack_from("<12siiffi", data) == (b"POINTCACHE2\0", 1, 37, 4.0, 3.0, 9)
    np.testing.assert_array_equal(np.frombuffer(data, "<f4", offset=32).reshape(9, 37, 3), run.positions(slice(4, 31, 3)))


@pytest.mark.parametrize("suffix", [".usdc", ".usda"])
def test_usd_has_units_axis_rate_names_and_every_frame(trajectory, run, tmp_path, suffix):
    pxr = pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom
    export(trajectory, tmp_path / f"a{suffix}")
    stage = Usd.Stage.Open(str(tmp_path / f"a{suffix}"))
    assert pxr
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert (stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()) == (60.0, 60.0)
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0.0, 30.0)
    world = stage.GetDefaultPrim()
    assert [prim.GetName() for prim in world.GetChildren()] == ["sheet", "line", "crate_0", "crate_1", "dots", "colliders"]
    assert world.GetChild("crate_1").GetDisplayName() == "crate.1"
    for name, path in (("sheet", "sheet/surface"), ("crate.1", "crate_1/surface"), ("line", "line/lines"), ("dots", "dots/points")):
        shape = UsdGeom.PointBased(stage.GetPrimAtPath(f"/world/{path}"))
        body = run.body(name)
        for frame in (0, 11, 30):
            np.testing.assert_array_equal(np.array(shape.GetPointsAttr().Get(frame)), body.positions(frame))
            np.testing.assert_array_equal(np.array(shape.GetVelocitiesAttr().Get(frame)), body.velocities(frame))
    sheet = UsdGeom.Mesh(stage.GetPrimAtPath("/world/sheet/surface"))
    np.testing.assert_array_equal(np.reshape(sheet.GetFaceVertexIndicesAttr().Get(), (-1, 3)), run.body("sheet").triangles)
    assert list(UsdGeom.BasisCurves(stage.GetPrimAtPath("/world/line/lines")).GetCurveVertexCountsAttr().Get()) == [6]
    assert list(UsdGeom.Points(stage.GetPrimAtPath("/world/dots/points")).GetWidthsAttr().Get()) == pytest.approx([0.2])
    box = UsdGeom.Xformable(stage.GetPrimAtPath("/world/colliders/box_1"))
    moved = box.ComputeLocalToWorldTransform(15).Transform((0.2, 0, 0))        # spun by 2 rad/s * 0.25 s
    np.testing.assert_allclose(moved, [1 + 0.2 * np.cos(0.5), 1 + 0.2 * np.sin(0.5), 0.2], rtol=1e-6)
    assert stage.GetPrimAtPath("/world/colliders/log")


@pytest.mark.parametrize(("output", "frames", "message"), [
    ("a.fbx", None, r"cannot write \.fbx; use \.usdc"), ("a", None, "without suffix"), ("a.obj", [31], "there is no frame 31"),
    ("a.pc2", [0, 1, 5], "equal distances"), ("a.pc2", [5, 3], "equal distances"),
    ("there.ply", [2], "there_0002.ply exists already")])
def test_what_cannot_be_written_is_refused_in_one_line(trajectory, tmp_path, output, frames, message):
    (tmp_path / "there_0002.ply").write_text("mine")
    with pytest.raises(ExportError, match=message):
        export(trajectory, tmp_path / output, frames)
    assert [file.name for file in tmp_path.iterdir()] == ["there_0002.ply"]
    assert (tmp_path / "there_0002.ply").read_text() == "mine"


def test_what_is_there_is_overwritten_when_asked(trajectory, tmp_path):
    (tmp_path / "a_0002.ply").write_text("mine")
    export(trajectory, tmp_path / "a.ply", [2], overwrite=True)
    assert (tmp_path / "a_0002.ply").read_bytes().startswith(b"ply\n")


def test_double_precision_stays_so_where_the_format_has_it(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    position = np.random.default_rng(2).normal(size=(FRAMES, 23, 3))
    path = write(tmp_path / "fine.vtkhdf", position)
    np.testing.assert_array_equal(trimesh.load(export(path, tmp_path / "a.ply", [5])[0], process=False).vertices, position[5])
