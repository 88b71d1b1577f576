"""The commands of README.md work as they stand, in a copy of the folder that they are written for."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
INSTALLATION = 2        # the first two blocks install, run the main job and the tests: a fresh machine's business
BLOCKS = re.findall(r"^```sh\n(.*?)^```", README, re.DOTALL | re.MULTILINE)
COMMANDS = [line for block in BLOCKS[INSTALLATION:] for line in block.splitlines() if line and not line.startswith("#")]


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """What commands find in a clone: its scenes and the way in."""
    folder = tmp_path_factory.mktemp("clone")
    shutil.copytree(ROOT / "scenes", folder / "scenes")
    shutil.copy(ROOT / "cli.py", folder)
    return folder


def test_readme_has_commands():
    assert len(BLOCKS) >= INSTALLATION
    assert all(len(block.splitlines()) == 1 for block in BLOCKS[:INSTALLATION])
    assert "## " not in README or len(COMMANDS) >= 3


@pytest.mark.parametrize("block", BLOCKS[INSTALLATION:], ids=lambda block: block.splitlines()[0])
def test_block_runs(block, clone, environment):
    """In the order of the page, as a reader would: later blocks use files of earlier ones."""
    done = subprocess.run(["sh", "-e", "-c", block], cwd=clone, env=environment, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("scene", sorted(set(re.findall(r"scenes/[\w/]+\.yaml", README))))
def test_scenes_that_are_named_are_there(scene):
    assert (ROOT / scene).is_file()
