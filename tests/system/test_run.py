"""`verlet-numba run`: the file it writes, against the contract's table of paths, and its options."""

import json
import shutil
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

FRAMES, PARTICLES, BODIES = 31, 8 + 12 + 36 + 6 + 8 + 3, 8
PARTICLES_OF = [8, 12, 12, 12, 12, 6, 8, 3]
FACES_OF = [12, 12, 20, 20, 20, 0, 12, 0]
KINDS = ["box", "cloth", "icosahedron", "icosahedron", "icosahedron", "rope", "box", "particles"]
MASSES = [1.0, 0.24, 1.2, 1.2, 1.2, 0.6, 2.0, 6.0]
SCALARS = ["kinetic_energy", "potential_energy", "total_energy", "constraint_error_max", "constraint_error_rms",
           "penetration_max", "contacts", "relaxations", "fallbacks", "resting", "speed_max"]
VECTORS = ["momentum", "angular_momentum", "centre_of_mass"]
OF_THE_RUN = {"provenance/timing", "provenance/start", "provenance/end"}
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def found(mixed, datasets):
    return datasets(mixed.trajectory)


def difference(a, b):
    """Paths of what differs between two files' datasets."""
    return {path for path in a.keys() | b.keys()
            if path not in a or path not in b or a[path].dtype != b[path].dtype or not np.array_equal(a[path], b[path])}


def grid():
    """Particles of the cloth: (i, j) is number 3 i + j, i along x, j along y."""
    return [[-0.6 + 0.4 * i, 3 - 0.3 + 0.3 * j, 0.8] for i in range(4) for j in range(3)]


def corners(x):
    """Corners of a box: 4 ix + 2 iy + iz."""
    return [[x + dx, -3 + dy, 0.5 + dz] for dx in (-0.2, 0.2) for dy in (-0.1, 0.1) for dz in (-0.3, 0.3)]


def test_every_path_of_the_contract(found):
    frames = (FRAMES,)
    cases = {"particles/trajectory/position/value": ((FRAMES, PARTICLES, 3), "f4"),
             "particles/trajectory/velocity/value": ((FRAMES, PARTICLES, 3), "f4"),
             "particles/trajectory/time": (frames, "f8"), "particles/trajectory/step": (frames, "i8"),
             "VTKHDF/Points": ((FRAMES * PARTICLES, 3), "f4"),
             "VTKHDF/PointData/velocity": ((FRAMES * PARTICLES, 3), "f4"),
             "VTKHDF/Lines/Connectivity": ((6 + 2,), "i8"), "VTKHDF/Polygons/Connectivity": ((3 * sum(FACES_OF),), "i8"),
             "VTKHDF/Steps/Values": (frames, "f8"),
             **{f"observables/{name}/value": (frames, None) for name in SCALARS},
             **{f"observables/{name}/value": ((FRAMES, 3), "f8") for name in VECTORS},
             **{f"bodies/{name}": ((BODIES,), None)
                for name in ("name", "kind", "first_particle", "particles", "first_face", "faces", "mass")},
             **{f"provenance/{name}": ((), None) for name in (
                 "scene_text", "folder", "scene", "command", "seed", "versions", "cpu", "start", "end", "timing", "status")}}
    for path, (shape, dtype) in cases.items():
        assert found[path].shape == shape, path
        assert dtype is None or found[path].dtype == dtype, path
    pairs = found["connectivity/distance/pairs"]
    assert pairs.dtype.kind == "i"
    assert found["connectivity/distance/length"].shape == pairs.shape[:1]


def test_positions_are_compressed_and_stored_once(mixed):
    with h5py.File(mixed.trajectory) as file:
        for field, seen in (("position", "VTKHDF/Points"), ("velocity", "VTKHDF/PointData/velocity")):
            dataset = file[f"particles/trajectory/{field}/value"]
            assert (dataset.compression, dataset.compression_opts, dataset.shuffle) == ("gzip", 1, True)
            assert file[seen].is_virtual
            np.testing.assert_array_equal(file[seen][:], dataset[:].reshape(-1, 3))


def test_frames_begin_at_the_start_and_keep_the_rate(found):
    np.testing.assert_allclose(found["particles/trajectory/time"], np.arange(FRAMES) / 60, rtol=1e-15)
    np.testing.assert_array_equal(found["particles/trajectory/step"], 2 * np.arange(FRAMES))
    np.testing.assert_array_equal(found["VTKHDF/Steps/Values"], found["particles/trajectory/time"])


def test_frame_0_is_the_initial_state_in_scene_order(found):
    start, velocity = (found[f"particles/trajectory/{name}/value"][0] for name in ("position", "velocity"))
    rope = [[-1 + 0.4 * k, 0, 1] for k in range(6)]
    expected = {0: corners(0.0), 8: grid(), 56: rope, 62: corners(2.0), 70: [[-3, 0, 1], [-3, 0, 1.5], [-4, 0, 2]]}
    for first, points in expected.items():
        np.testing.assert_allclose(start[first:first + len(points)], points, atol=1e-6)
    for first in (20, 32, 44):          # the dice: vertices at their radius about a centre within the region
        centre = start[first:first + 12].mean(0)
        np.testing.assert_allclose(np.linalg.norm(start[first:first + 12] - centre, axis=1), 0.1, rtol=1e-4)
        assert (centre > [2, -2, 0.3]).all()
        assert (centre < [5, 2, 2]).all()
    np.testing.assert_allclose(velocity[72], [1, 2, 3], atol=1e-5)
    for first, last in ((0, 8), (20, 56), (62, 72)):        # what is not held by pins
        np.testing.assert_allclose(velocity[first:last], 0, atol=1e-5)


def test_bodies_constraints_and_faces_count_in_scene_order(found):
    names = [name.decode() for name in found["bodies/name"]]
    assert [name.split(".")[0] for name in names] == ["crate", "sheet", "dice", "dice", "dice", "line", "lid", "dots"]
    assert len(set(names)) == BODIES
    assert [kind.decode() for kind in found["bodies/kind"]] == KINDS
    for count, first, numbers in (("particles", "first_particle", PARTICLES_OF), ("faces", "first_face", FACES_OF)):
        np.testing.assert_array_equal(found[f"bodies/{count}"], numbers)
        np.testing.assert_array_equal(found[f"bodies/{first}"], np.cumsum([0, *numbers])[:-1])
    np.testing.assert_allclose(found["bodies/mass"], MASSES, rtol=1e-12)

    pairs, length = found["connectivity/distance/pairs"], found["connectivity/distance/length"]
    start = found["particles/trajectory/position/value"][0].astype(float)
    np.testing.assert_allclose(np.linalg.norm(start[pairs[:, 1]] - start[pairs[:, 0]], axis=1), length, rtol=1e-5)
    owner = np.repeat(np.arange(BODIES), PARTICLES_OF)
    np.testing.assert_array_equal(owner[pairs[:, 0]], owner[pairs[:, 1]])
    sticks = np.bincount(owner[pairs[:, 0]], minlength=BODIES)
    assert sticks[1] == 3 * 3 + 4 * 2 + 2 * 3 * 2       # cloth: along x, along y, both diagonals
    assert (sticks[5], sticks[7]) == (5, 1)

    triangles = found["VTKHDF/Polygons/Connectivity"].reshape(-1, 3)
    np.testing.assert_array_equal(owner[triangles[:, 0]], np.repeat(np.arange(BODIES), FACES_OF))
    cloth = triangles[12:24] - 8        # cell (0, 0): (i,j) (i+1,j) (i+1,j+1) and (i,j) (i+1,j+1) (i,j+1)
    assert {tuple(row) for row in cloth.tolist()} >= {(0, 3, 4), (0, 4, 1)}


def test_what_happens_is_physical(found):
    """Pins hold, and what falls freely falls by g t^2/2: the file shows the simulation, not the numbering's mirror."""
    time, value = found["particles/trajectory/time"], found["particles/trajectory/position/value"]
    for pinned in (8, 10, 17, 19, 56, 61):
        np.testing.assert_array_equal(value[:, pinned], np.broadcast_to(value[0, pinned], (FRAMES, 3)))
    fall = [-4, 0, 2] + time[:, None] * [1, 2, 3] - 0.5 * 9.81 * (time**2)[:, None] * [0, 0, 1]
    np.testing.assert_allclose(value[:, 72], fall, atol=1e-5)
    np.testing.assert_allclose(found["particles/trajectory/velocity/value"][:, 72, 2], 3 - 9.81 * time, atol=1e-4)
    weights = np.repeat(np.array(MASSES) / PARTICLES_OF, PARTICLES_OF)
    weights[70:] = [1, 2, 3]
    np.testing.assert_allclose(found["observables/centre_of_mass/value"], (value * weights[:, None]).sum(1) / sum(MASSES),
                               atol=1e-5)


def test_provenance_is_enough_to_repeat_the_run(found, mixed):
    text = {name: found[f"provenance/{name}"].item() for name in ("scene_text", "scene", "command", "versions", "status")}
    assert found["provenance/folder"].item().decode() == str(mixed.scene.parent.resolve())
    assert text["scene_text"].decode() == mixed.scene.read_text(encoding="utf-8")
    scene = json.loads(text["scene"])
    assert scene["effects"]["gravity"] == [0, 0, -9.81]
    assert scene["effects"]["contact"] == "none"
    assert scene["bodies"][2]["radius"] == 0.1
    assert text["command"].decode() == f"verlet-numba run {mixed.scene}"
    assert {"verlet-numba", "numba", "numpy", "h5py"} <= json.loads(text["versions"]).keys()
    assert text["status"].rstrip(b"\0") == b"complete"
    assert found["provenance/seed"] == 3
    timing = json.loads(found["provenance/timing"].item())
    assert timing["phases"].keys() == {"build", "compile", "simulate", "write"}
    assert sum(timing["chunks"]["frames"]) == len(found["particles/trajectory/time"])
    assert sum(timing["chunks"]["simulate"]) == pytest.approx(timing["phases"]["simulate"])
    assert found["provenance/start"].item().decode() <= found["provenance/end"].item().decode()


def test_every_way_to_start_it_writes_the_same(mixed, verlet, datasets, found, environment):
    """Two equal runs differ in nothing but when they ran; neither the entry nor the threads change a bit."""
    script = shutil.which("verlet-numba", path=environment["PATH"])
    assert script, "the console script is not installed"
    ways = {"script": [script], "file": [sys.executable, str(ROOT / "cli.py")], "one thread": None}
    for number, (way, program) in enumerate(ways.items()):
        output = mixed.folder / f"again_{number}.vtkhdf"
        threads = ["--threads", 1] if program is None else []
        verlet("run", mixed.scene, "-o", output, "-q", *threads, program=program)
        assert difference(found, datasets(output)) <= OF_THE_RUN | {"provenance/command"}, way


def test_a_repeated_command_differs_only_in_its_times(mixed, verlet, datasets, found):
    folder = mixed.folder / "repeated"
    folder.mkdir()
    verlet("run", mixed.scene, cwd=folder)
    assert difference(found, datasets(folder / "mixed.vtkhdf")) <= OF_THE_RUN


def test_frames_cut_a_run_short(mixed, verlet, datasets, found, tmp_path):
    verlet("run", mixed.scene, "--frames", 7, "-o", tmp_path / "x.vtkhdf")
    short = datasets(tmp_path / "x.vtkhdf")
    for path in ("particles/trajectory/position/value", "observables/total_energy/value"):
        np.testing.assert_array_equal(short[path], found[path][:8])


def test_set_overrides_keys(mixed, verlet, datasets, tmp_path):
    sets = {"bodies.line.mass": "4", "bodies.0.position": "[0, -3, 2]", "time.duration": "5e-2", "solver.iterations": "2",
            "name": "no", "output.observables": "false"}
    verlet("run", mixed.scene, *(word for key, value in sets.items() for word in ("--set", f"{key}={value}")), cwd=tmp_path)
    changed = datasets(tmp_path / "no.vtkhdf")
    assert changed["bodies/mass"][5] == pytest.approx(4)
    np.testing.assert_allclose(changed["particles/trajectory/position/value"][0, :8].mean(0), [0, -3, 2], atol=1e-6)
    assert len(changed["particles/trajectory/time"]) == 4
    assert json.loads(changed["provenance/scene"].item())["solver"]["iterations"] == 2
    assert changed["provenance/scene_text"].item().decode() == mixed.scene.read_text(encoding="utf-8")
    assert not [path for path in changed if path.startswith("observables")]


def test_json_is_alone_on_stdout(mixed, verlet, tmp_path):
    done = verlet("run", mixed.scene, "--json", "-v", "-o", tmp_path / "x.vtkhdf")
    summary = json.loads(done.stdout)
    assert (summary["status"], summary["frames"], summary["substeps"]) == ("complete", FRAMES, 60)
    assert summary["output"] == str(tmp_path / "x.vtkhdf")
    assert summary["divergence"] is None
    assert done.stderr                  # what -v says


def test_summary_and_quiet(mixed, verlet, tmp_path):
    told = verlet("run", mixed.scene, "-o", tmp_path / "x.vtkhdf").stdout
    for word in ("31 frames", "steps/s", "real time", "relaxations", "contacts", "constraint error", "penetration", "write"):
        assert word in told
    quiet = verlet("run", mixed.scene, "-q", "-o", tmp_path / "y.vtkhdf")
    assert (quiet.stdout, quiet.stderr) == ("", "")


def test_nothing_is_overwritten_unasked(mixed, verlet, tmp_path):
    """Refused before anything is simulated: with a frame rate at which the run would take an hour."""
    output = tmp_path / "mixed.vtkhdf"
    output.write_bytes(b"precious")
    done = verlet("run", mixed.scene, "--set", "time.duration=90000", cwd=tmp_path, code=2)
    assert done.stdout == ""
    assert "mixed.vtkhdf exists already" in done.stderr
    assert "--overwrite" in done.stderr
    assert output.read_bytes() == b"precious"
    verlet("run", mixed.scene, "--frames", 1, "--overwrite", cwd=tmp_path)
    assert h5py.is_hdf5(output)
    assert [path.name for path in tmp_path.iterdir()] == ["mixed.vtkhdf"]


def test_output_folders_that_cannot_be_used(mixed, verlet, tmp_path):
    (tmp_path / "file").write_text("")
    for output, words, code in ((tmp_path / "none" / "x.vtkhdf", "no folder", 2), (tmp_path / "file" / "x.vtkhdf", "no folder", 2),
                                (tmp_path, "folder", 2), (Path("/proc/x.vtkhdf"), "/proc", 1)):
        done = verlet("run", mixed.scene, "-q", "--overwrite", "-o", output, code=code)
        assert words in done.stderr
        assert len(done.stderr.splitlines()) == 1


def test_a_scene_without_a_name_gives_the_file_that_of_the_scene_file(verlet, write_scene, tmp_path):
    verlet("run", write_scene(bodies=[{"kind": "particles", "positions": [[0, 0, 0]], "masses": [1]}]), cwd=tmp_path)
    assert (tmp_path / "scene.vtkhdf").exists()


def test_mantissas_are_rounded(mixed, verlet, found, datasets, tmp_path):
    verlet("run", mixed.scene, "--set", "output.precision_bits=12", "-q", "-o", tmp_path / "x.vtkhdf")
    rounded, path = datasets(tmp_path / "x.vtkhdf"), "particles/trajectory/position/value"
    assert not (rounded[path].view(np.uint32) & 0xfff).any()        # 24 bits, the first not stored, less 12
    np.testing.assert_allclose(rounded[path], found[path], rtol=2.0**-12)
    assert not np.array_equal(rounded[path], found[path])
    np.testing.assert_array_equal(rounded["observables/total_energy/value"], found["observables/total_energy/value"])
    assert (tmp_path / "x.vtkhdf").stat().st_size < mixed.trajectory.stat().st_size


def test_double_precision_on_request(mixed, verlet, found, datasets, tmp_path):
    verlet("run", mixed.scene, "--set", "output.precision=float64", "-q", "-o", tmp_path / "x.vtkhdf")
    double, path = datasets(tmp_path / "x.vtkhdf"), "particles/trajectory/position/value"
    assert double[path].dtype == double["VTKHDF/Points"].dtype == np.float64
    np.testing.assert_array_equal(double[path].astype(np.float32), found[path])
    assert not np.array_equal(double[path], found[path])


def test_velocities_are_of_second_order(verlet, datasets, write_scene, tmp_path):
    """Against v0 exp(-k t): half the step, a quarter of the error, at every frame's own time."""
    body = {"kind": "particles", "positions": [[0, 0, 0]], "masses": [1], "velocity": [1, 0, 0]}
    scene = write_scene(effects={"drag": {"linear": 8}}, bodies=[body], output={"fields": ["velocity"]})
    errors = []
    for substeps in (1, 2):
        output = tmp_path / f"{substeps}.vtkhdf"
        verlet("run", scene, "--set", f"solver.substeps={substeps}", "-o", output)
        found = datasets(output)
        exact = np.exp(-8 * found["particles/trajectory/time"])
        errors.append(np.abs(found["particles/trajectory/velocity/value"][:, 0, 0] - exact).max())
    assert errors[0] < 5e-3
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)
