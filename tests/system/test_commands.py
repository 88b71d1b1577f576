"""The commands beside `run`: check, plan, schema, warm, render, help, versions, completion."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from verlet_numba._version import __version__

COMMANDS = ("run", "check", "plan", "schema", "warm", "render", "view", "export", "accuracy", "analyze", "compare",
            "verify", "sweep")
HEAVY = {"numba", "llvmlite", "scipy", "trimesh", "matplotlib", "h5py"}
# A process small enough that the memory it hands down to its child does not count.
PEAK_MEMORY = """\
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


@pytest.fixture(scope="module")
def planned(mixed, verlet):
    return json.loads(verlet("plan", mixed.scene, "--json").stdout)


def test_check_looks_at_every_file(verlet, mixed, tmp_path):
    """Errors of one do not hide the others; warnings have places too and make nothing wrong."""
    (tmp_path / "wrong.yaml").write_text("version: 1\nname: x\n", encoding="utf-8")
    (tmp_path / "odd.yaml").write_text(
        "version: 1\ntime: {duration: 1}\nbodies:\n"
        "  - {kind: particles, positions: [[0, 0, 0], [0, 0, 0]], masses: [1, 1], sticks: [[0, 1]]}\n", encoding="utf-8")
    done = verlet("check", "wrong.yaml", mixed.scene, "odd.yaml", cwd=tmp_path, code=2)
    assert [line.split(", ")[0] for line in done.stdout.splitlines()] == [f"{mixed.scene}: good", "odd.yaml: good"]
    assert "wrong.yaml:1:1: time: is missing" in done.stderr
    assert "odd.yaml:4:83: bodies.0.sticks.0: warning: " in done.stderr
    good = verlet("check", "odd.yaml", cwd=tmp_path)
    assert "warning" in good.stderr
    quiet = verlet("check", "odd.yaml", "-q", cwd=tmp_path)
    assert (quiet.stdout, quiet.stderr) == ("", "")


def test_plan_names_every_phase_and_why(planned):
    phases = {phase["name"]: phase for phase in planned["phases"]}
    assert phases["gravity"]["active"]
    for absent in ("contact with colliders", "wind", "drag", "damping", "angles", "tolerance"):
        assert not phases[absent]["active"]
    assert all(phase["why"] for phase in planned["phases"])
    assert (planned["particles"], planned["frames"], planned["substeps_a_frame"]) == (73, 31, 2)
    assert not [name for name in planned["buffers"] if "wind" in name or "drag" in name]
    assert all(size > 0 for size in planned["buffers"].values())


def test_plan_tells_the_same_in_words(planned, mixed, verlet):
    text = verlet("plan", mixed.scene).stdout
    for phase in planned["phases"]:
        lines = [line for line in text.splitlines() if line.endswith(phase["why"]) and phase["name"] in line]
        assert lines[0].split()[0] == ("active" if phase["active"] else "absent")
    assert f"memory: about {planned['memory_bytes'] / 1e6:.0f} MB" in text
    assert "file: at most" in text


@pytest.mark.parametrize("change", [[], ["--set", "bodies.dice.count=300", "--set",
                                          "bodies.dice.scatter.inside=[[-9, -9, 1], [9, 9, 9]]"]])
def test_no_file_is_larger_than_planned(verlet, mixed, tmp_path, change):
    """With numbers that hardly compress: 31 frames, few and many bodies."""
    sizes = json.loads(verlet("plan", mixed.scene, *change, "--json").stdout)
    verlet("run", mixed.scene, *change, "-o", tmp_path / "x.vtkhdf")
    assert (tmp_path / "x.vtkhdf").stat().st_size <= sizes["file_bytes_at_most"]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="counts memory as Linux does")
def test_memory_is_as_planned(verlet, write_scene, tmp_path):
    """The largest amount ever used, by a cloth of 10,000 particles whose code is compiled already; within a fifth."""
    cloth = {"kind": "cloth", "size": [1, 1], "resolution": [100, 100], "mass": 1}
    scene = write_scene(time={"duration": 2}, bodies=[cloth])
    verlet("warm", scene)
    told = verlet("-c", PEAK_MEMORY, sys.executable, "-m", "verlet_numba", "run", scene, "-q", "-o", tmp_path / "x.vtkhdf",
                  program=[sys.executable]).stdout
    planned = json.loads(verlet("plan", scene, "--json").stdout)["memory_bytes"]
    assert int(told) * 1024 == pytest.approx(planned, rel=0.2)


def references(node):
    """Every `$ref` below a node of a schema."""
    if isinstance(node, dict):
        yield from ([node["$ref"]] if "$ref" in node else [])
        node = list(node.values())
    if isinstance(node, list):
        for entry in node:
            yield from references(entry)


def test_schema_is_whole(verlet):
    schema = json.loads(verlet("schema").stdout)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert set(references(schema)) == {f"#/$defs/{name}" for name in schema["$defs"]}
    assert set(schema["required"]) == {"version", "time"}
    assert set(schema["properties"]) == {"version", "name", "time", "seed", "solver", "effects", "bodies", "attachments",
                                         "colliders", "output", "expect", "reference"}
    solver = schema["$defs"]["Solver"]["properties"]
    assert all("default" in key for key in solver.values())
    for definition in schema["$defs"].values():
        if definition["type"] == "object":
            assert definition["additionalProperties"] is False
            assert all("description" in key or "const" in key for key in definition["properties"].values())


def test_scenes_fit_the_schema(verlet, mixed):
    """Where a validator is installed: what runs is valid, and a wrong key is not."""
    jsonschema = pytest.importorskip("jsonschema")
    yaml = pytest.importorskip("yaml")
    schema = json.loads(verlet("schema").stdout)
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    scene = yaml.safe_load(mixed.scene.read_text(encoding="utf-8"))
    assert validator.is_valid(scene)
    assert not validator.is_valid({**scene, "bodys": []})


def test_warm_compiles_without_simulating(verlet, mixed, tmp_path):
    done = verlet("warm", mixed.scene, cwd=tmp_path)
    assert done.stdout.startswith(f"{mixed.scene}: ready after ")
    assert Path(done.stdout.split("machine code in ")[1].strip()).is_dir()
    assert list(tmp_path.iterdir()) == []


def test_render_draws_a_sheet(verlet, mixed, tmp_path):
    verlet("render", mixed.trajectory, "-o", tmp_path / "x.png", "--frames", "0,10:20:5")
    with Image.open(tmp_path / "x.png") as image:
        assert image.format == "PNG"
        assert len(image.getcolors(1 << 24)) > 100
    before = (tmp_path / "x.png").read_bytes()
    assert "exists already" in verlet("render", mixed.trajectory, "-o", tmp_path / "x.png", code=2).stderr
    assert (tmp_path / "x.png").read_bytes() == before


def test_render_draws_an_animation(verlet, mixed, tmp_path):
    verlet("render", mixed.trajectory, "-o", tmp_path / "x.gif", "--frames", "0:30:10")
    with Image.open(tmp_path / "x.gif") as image:
        assert (image.format, image.n_frames) == ("GIF", 3)


@pytest.mark.parametrize(("arguments", "code", "words"), [
    (["-o", "x.jpg"], 2, ".png"), (["-o", "x.png", "--frames", "31"], 2, "no frame 31"),
    (["-o", "x.png", "--frames", "last"], 2, "--frames"), (["-o", "none/x.png"], 2, "none")])
def test_render_says_what_it_cannot(verlet, mixed, tmp_path, arguments, code, words):
    assert words in verlet("render", mixed.trajectory, *arguments, cwd=tmp_path, code=code).stderr
    assert list(tmp_path.iterdir()) == []


def test_versions(verlet):
    told = verlet("--version").stdout
    assert __version__ in told
    assert "file format" in told
    assert "numba" in told


def test_help_of_everything(verlet):
    overview = verlet("--help").stdout
    for command in COMMANDS:
        assert f"\n  {command} " in overview
        told = verlet(command, "--help").stdout
        assert f"verlet-numba {command}" in told
        assert len(told.splitlines()) > 5
    assert verlet("run", "-h").stdout == verlet("run", "--help").stdout


@pytest.mark.parametrize("arguments", [["--help"], *([command, "--help"] for command in COMMANDS), ["check"], ["plan"], ["schema"]],
                         ids=" ".join)
def test_quick_commands_import_nothing_heavy(verlet, mixed, arguments):
    scene = [mixed.scene] if arguments[0] in ("check", "plan") else []
    assert imported(*arguments, *map(str, scene)) & HEAVY == set()


def imported(*arguments, environment=None):
    """Top-level packages that a command loads."""
    done = subprocess.run([sys.executable, "-X", "importtime", "-m", "verlet_numba", *arguments], capture_output=True,
                          text=True, check=True, timeout=60, env=environment)
    lines = [line for line in done.stderr.splitlines() if line.startswith("import time:")]
    assert len(lines) > 50
    return {line.rsplit("|", 1)[1].strip().split(".")[0] for line in lines}


def test_completion_of_the_shell(environment):
    asked = {**environment, "_VERLET_NUMBA_COMPLETE": "bash_source"}
    script = subprocess.run(["verlet-numba"], env=asked, capture_output=True, text=True, check=True, timeout=60).stdout
    assert "complete -o nosort -F" in script
    asked = {**environment, "_VERLET_NUMBA_COMPLETE": "bash_complete", "COMP_WORDS": "verlet-numba r", "COMP_CWORD": "1"}
    found = subprocess.run(["verlet-numba"], env=asked, capture_output=True, text=True, check=True, timeout=60).stdout
    assert sorted(found.split()) == ["plain,render", "plain,run"]
    assert imported(environment=asked) & HEAVY == set()
