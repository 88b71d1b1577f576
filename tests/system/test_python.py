"""docs/python.md works as it stands: its commands, then its lines of Python, on the runs that they make."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/python.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def folder(tmp_path_factory, environment):
    """What a reader has after the page's commands."""
    place = tmp_path_factory.mktemp("python")
    shutil.copytree(ROOT / "scenes/gallery", place / "scenes/gallery")
    (place / "docs").mkdir()
    shutil.copy(ROOT / "docs/training_set.py", place / "docs")
    for block in re.findall(r"^```sh\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE):
        subprocess.run(["sh", "-e", "-c", block], cwd=place, env=environment, check=True, capture_output=True, timeout=300)
    shutil.copy(place / "flag_7.vtkhdf", place / "flag.vtkhdf")
    return place


@pytest.mark.parametrize("block", re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE))
def test_python_of_the_page_runs(folder, block):
    if "to_xarray" in block:
        pytest.importorskip("xarray")
        block = "import verlet_numba\n" + block
    done = subprocess.run([sys.executable, "-c", block], cwd=folder, capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr


def test_the_set_holds_what_its_script_says(folder):
    told = json.loads((folder / "set/set.json").read_text(encoding="utf-8"))
    assert (told["graphs"], told["samples"]) == (3, 3 * 60)
    winds = set()
    for file in sorted((folder / "set").glob("*.npz")):
        graph = np.load(file)
        winds.add(graph["wind"][0])
        nodes = graph["position"].shape[1]
        assert graph["position"].shape == graph["velocity"].shape == (61, nodes, 3)
        assert 0 < graph["pinned"].sum() < nodes
        assert graph["edges"].max() == graph["triangles"].max() == nodes - 1
        start = graph["position"][0][graph["edges"]]
        np.testing.assert_allclose(np.linalg.norm(start[:, 0] - start[:, 1], axis=1), graph["rest"], rtol=1e-5)
        velocity = np.gradient(graph["position"], graph["interval"], axis=0)[1:-1]
        assert np.corrcoef(velocity.ravel(), graph["velocity"][1:-1].ravel())[0, 1] > 0.7       # a flag beats within frames
    assert winds == {4, 7, 10}
