"""Pages: what is packed comes out again, here and in the page's own script; what is too long is thinned; pages are whole."""

import base64
import gzip
import json
import re
import shutil
import subprocess
import sys
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from trajectories import variety, write

from verlet_numba.run.layout import BodyTable
from verlet_numba.study import pack, reader
from verlet_numba.study.render import RenderError
from verlet_numba.study.view import fill, view

WORDS = arrays(np.uint16, array_shapes(min_dims=2, max_dims=2, max_side=9).map(lambda shape: (*shape, 3)))

NODE = pytest.mark.skipif(not shutil.which("node"), reason="runs the page's own scripts, which needs node on PATH")


def whole(planes):
    """Words (F, N, 3) from planes (2, F, 3, N): `wholeSteps` of page/decode.js, by running sums modulo 2^16."""
    folded = planes[0].astype(np.uint16) | (planes[1].astype(np.uint16) << 8)
    words = ((folded >> 1) ^ (0 - (folded & 1)).astype(np.uint16)).astype(np.uint16)
    words = np.cumsum(words, axis=2, dtype=np.uint16)
    for order in (1, 0):
        words[order:] = np.cumsum(words[order:], axis=0, dtype=np.uint16)
    return words.transpose(0, 2, 1)


def unpacked(page):
    """Header and arrays of a page's text."""
    header = json.loads(re.search(r'<script type="application/json" id="header">(.*?)</script>', page, re.DOTALL)[1])
    data = gzip.decompress(base64.b64decode(re.search(r'<script type="text/plain" id="data">(.*?)</script>', page, re.DOTALL)[1]))
    found = {}
    for entry in header["arrays"]:
        count = int(np.prod(entry["shape"]))
        found[entry["name"]] = np.frombuffer(data, f"<{entry['type']}", count, entry["place"]).reshape(entry["shape"])
    return header, found


@pytest.fixture(scope="module")
def trajectory(tmp_path_factory):
    return variety(tmp_path_factory.mktemp("view") / "variety.vtkhdf")


@given(WORDS)
def test_differences_come_back(words):
    np.testing.assert_array_equal(whole(pack.planes(pack.differences(words))), words)


def test_what_moves_evenly_packs_to_almost_nothing():
    time, place = np.arange(50)[:, None, None], np.arange(40)[:, None]
    words = (300 * place + 7 * time + np.array([0, 1, 2])).astype(np.uint16)
    assert np.count_nonzero(pack.differences(words)) <= 3 * 40 + 3      # a start for each, a speed for the first


@given(arrays(np.float64, (4, 5, 3), elements=st.floats(-1e5, 1e5)))
def test_rounding_is_half_a_step_at_most(positions):
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    found = pack.Quantised(pack.quantise(positions, low, high), low, (high - low) / pack.LEVELS)
    back = found.low + found.step * found.words
    rounding = 1e-9 * np.abs(positions).max() + 1e-300
    assert (np.abs(back - positions) <= 0.5 * found.step + rounding).all()
    assert np.abs(back - positions).max() <= found.error + rounding


def test_a_page_holds_the_trajectory(trajectory, tmp_path):
    told = view(trajectory, tmp_path / "a.html")
    assert (told.frames, told.of, told.every) == (31, 31, 1)
    assert told.size == (tmp_path / "a.html").stat().st_size
    header, found = unpacked((tmp_path / "a.html").read_text(encoding="utf-8"))
    with reader.open(trajectory) as run:
        shown = np.array(header["low"]) + np.array(header["step"]) * whole(found["position"])
        assert np.abs(shown - run.positions()).max() <= header["error"] * 1.001
        assert header["error"] == told.error
        np.testing.assert_allclose(found["time"], run.time, rtol=1e-6)
        np.testing.assert_array_equal(found["triangles"], run.triangles)
        np.testing.assert_array_equal(found["pairs"], run.pairs)
        np.testing.assert_allclose(found["total_energy"], run.observables["total_energy"], rtol=1e-6)
    assert [body["name"] for body in header["bodies"]] == ["sheet", "line", "crate.0", "crate.1", "dots"]
    assert [round(body["line"], 3) for body in header["bodies"]][1] == 0.04         # half the rope's thickness
    assert header["bodies"][4]["dot"] == pytest.approx(0.1)
    assert found["segments"].tolist() == [[k, k + 1] for k in range(12, 17)] + [[34, 35]]
    assert found["dots"].tolist() == [*range(12, 18), 34, 35, 36]
    assert [entry["kind"] for entry in header["colliders"]] == ["plane", "box", "cylinder"]
    assert (found["poses 0"].shape, found["poses 1"].shape) == ((1, 12), (31, 12))
    assert len(found["points 1"]) > 7
    assert found["corners 1"].max() == len(found["points 1"]) - 1


CHECK = """
const fs = require("fs"), header = JSON.parse(fs.readFileSync("header.json", "utf8"));
unpack(fs.readFileSync("data.txt", "utf8"), header.arrays).then((arrays) => {
  const motion = new Motion(header, arrays), mesh = creased(arrays["points 2"], arrays["corners 2"]);
  motion.seek(10.25 / 60, true);
  const told = { words: motion.words, triangles: arrays.triangles, positions: motion.positions, normals: motion.normals,
    strains: motion.strains, pose: motion.pose(1, 10.25 / 60), places: mesh.positions, across: mesh.normals };
  process.stdout.write(JSON.stringify(Object.fromEntries(Object.entries(told).map(([name, values]) => [name, [...values]]))));
});"""


@pytest.fixture(scope="module")
def scripted(trajectory, tmp_path_factory):
    """A page, and what its own scripts make of it in node."""
    folder = tmp_path_factory.mktemp("node")
    view(trajectory, folder / "a.html")
    page = (folder / "a.html").read_text(encoding="utf-8")
    (folder / "header.json").write_text(re.search(r'id="header">(.*?)</script>', page, re.DOTALL)[1], encoding="utf-8")
    (folder / "data.txt").write_text(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1], encoding="utf-8")
    own = files("verlet_numba.study").joinpath("page")
    scripts = [own.joinpath(f"{name}.js").read_text(encoding="utf-8") for name in ("decode", "matrix", "motion")]
    (folder / "check.js").write_text("\n".join([*scripts, CHECK]), encoding="utf-8")
    told = subprocess.run(["node", "check.js"], cwd=folder, capture_output=True, text=True, check=True).stdout
    return page, {name: np.array(values) for name, values in json.loads(told).items()}


@NODE
def test_the_pages_script_decodes_the_same(scripted):
    page, told = scripted
    _, found = unpacked(page)
    np.testing.assert_array_equal(told["words"].reshape(31, 3, 37).transpose(0, 2, 1), whole(found["position"]))
    np.testing.assert_array_equal(told["triangles"], found["triangles"].ravel())


@NODE
def test_the_pages_script_moves_bodies_as_the_trajectory_does(scripted, trajectory):
    """A quarter of the way from frame 10 to 11: positions, normals of the sheet, strain, the pose of a spinning box."""
    _, told = scripted
    with reader.open(trajectory) as run:
        before, after = run.positions([10, 11]).astype(float)
        pairs, lengths, triangles = run.pairs, run.lengths, run.body("sheet").triangles
    expected = before + 0.25 * (after - before)
    positions = told["positions"].reshape(-1, 3)
    np.testing.assert_allclose(positions, expected, atol=1e-4)
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    normals = np.zeros((37, 3))
    for k in range(3):
        np.add.at(normals, triangles[:, k], np.cross(b - a, c - a))
    np.testing.assert_allclose(told["normals"].reshape(-1, 3), normals, atol=1e-6)
    strain = np.linalg.norm(positions[pairs[:, 0]] - positions[pairs[:, 1]], axis=1) / lengths - 1
    for particle in (0, 5, 14, 36):
        own = strain[(pairs == particle).any(axis=1)]
        assert told["strains"][particle] == pytest.approx(own[np.argmax(np.abs(own))] if len(own) else 0, abs=1e-5)
    angle = 2.0 * 10.25 / 60
    np.testing.assert_allclose(told["pose"].reshape(4, 4).T, [
        [np.cos(angle), -np.sin(angle), 0, 1], [np.sin(angle), np.cos(angle), 0, 1], [0, 0, 1, 0.2], [0, 0, 0, 1]], atol=1e-4)


@NODE
def test_a_cylinder_is_round_along_its_side_and_sharp_at_its_rims(scripted):
    _, told = scripted
    places, across = told["places"].reshape(-1, 3), told["across"].reshape(-1, 3)
    lids = np.abs(across[:, 1]) > 0.5
    np.testing.assert_allclose(np.abs(across[lids]), np.broadcast_to([0, 1, 0], (lids.sum(), 3)), atol=1e-6)
    radial = places[~lids] * [1, 0, 1]
    np.testing.assert_allclose(across[~lids], radial / np.linalg.norm(radial, axis=1, keepdims=True), atol=0.05)
    assert lids.sum() == 2 * 3 * 72
    assert (across[lids] * places[lids]).sum(axis=1).min() > 0


@NODE
def test_the_pages_script_is_one_that_parses(trajectory, tmp_path):
    view(trajectory, tmp_path / "a.html")
    script = re.findall(r"<script>(.*?)</script>", (tmp_path / "a.html").read_text(encoding="utf-8"), re.DOTALL)[-1]
    (tmp_path / "page.js").write_text(script, encoding="utf-8")
    subprocess.run(["node", "--check", "page.js"], cwd=tmp_path, check=True)


def test_equal_input_gives_equal_pages(trajectory, tmp_path):
    for name in ("a.html", "b.html"):
        view(trajectory, tmp_path / name)
    assert (tmp_path / "a.html").read_bytes() == (tmp_path / "b.html").read_bytes()


@pytest.mark.parametrize(("budget", "every"), [(31 * 37 * 6, 1), (31 * 37 * 6 - 1, 2), (8 * 37 * 6, 4), (1, 31 * 37 * 6)])
def test_frames_are_thinned_to_the_budget(trajectory, tmp_path, budget, every):
    told = view(trajectory, tmp_path / "a.html", budget=budget)
    header, found = unpacked((tmp_path / "a.html").read_text(encoding="utf-8"))
    assert (told.every, header["every"]) == (every, every)
    assert (told.of, header["of"]) == (31, 31)
    np.testing.assert_allclose(found["time"], np.arange(0, 31, every) / 60, rtol=1e-6)


def test_a_cloth_of_1600_particles_and_120_frames_fits_a_megabyte(tmp_path):
    """A sheet in waves of many lengths and speeds, none of which repeats."""
    i, j = np.mgrid[:40, :40] / 39
    time = np.arange(120)[:, None, None] / 60
    chance = np.random.default_rng(5)
    height = sum(0.06 / k * np.sin(2 * np.pi * (k * (i * np.cos(a) + j * np.sin(a)) - k**0.5 * time + b))
                 for k, a, b in zip(range(1, 13), *chance.uniform(0, 6, (2, 12)), strict=True))
    position = np.stack(np.broadcast_arrays(i + 0.1 * np.roll(height, 5, 1), j, height), -1).reshape(120, 1600, 3)
    corner = np.arange(1600).reshape(40, 40)
    cells = np.concatenate([np.stack([corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:]], -1).reshape(-1, 3),
                            np.stack([corner[:-1, :-1], corner[1:, 1:], corner[:-1, 1:]], -1).reshape(-1, 3)])
    table = BodyTable(["sheet"], ["cloth"], [0], [1600], [0], [len(cells)], [0.2])
    pairs = np.concatenate([corner[:-1].ravel()[:, None] + [0, 40], corner[:, :-1].ravel()[:, None] + [0, 1]])
    path = write(tmp_path / "cloth.vtkhdf", position, scene={"name": "cloth"}, table=table, triangles=cells, pairs=pairs,
                 lengths=np.full(len(pairs), 1 / 39))
    assert view(path, tmp_path / "cloth.html").size <= 1e6


@pytest.mark.parametrize(("output", "frames", "message"), [
    ("a.htm5", None, "cannot write .htm5; use .html"), ("a", None, "without suffix; use .html"),
    ("a.html", [40], "there is no frame 40: it has 31")])
def test_what_cannot_be_shown_is_refused_in_one_line(trajectory, tmp_path, output, frames, message):
    with pytest.raises(RenderError, match=message):
        view(trajectory, tmp_path / output, frames)
    assert not (tmp_path / output).exists()


def test_frames_are_chosen(trajectory, tmp_path):
    assert view(trajectory, tmp_path / "a.html", [0, slice(10, 20, 5), -1]).frames == 4
    assert view(trajectory, tmp_path / "one.html", [3]).frames == 1


def test_what_is_filled_in_is_not_filled_again():
    assert fill("<{{a}}|{{b}}>", {"a": "{{b}}", "b": "x"}) == "<{{b}}|x>"


def test_the_pages_code_is_light():
    heavy = {"numba", "matplotlib", "trimesh", "scipy", "PIL"}
    code = f"import sys, verlet_numba.study.view; print(*{heavy} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "\n"
