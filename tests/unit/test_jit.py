"""Machine code on disk: an edited callee in another file is never served stale, and nothing else is compiled twice."""

import fcntl
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.caching import IndexDataCacheFile

from verlet_numba import _jit

PACKAGE = Path(_jit.__file__).parent
CALLEE = "from verlet_numba._jit import kernel\n\n\n@kernel\ndef double(x):\n    return {factor} * x\n"
CALLER = ("from verlet_numba._jit import kernel\nfrom verlet_numba.kernels.callee import double\n\n\n"
          "@kernel\ndef twice_and_one(x):\n    return double(x) + 1.0\n")
RUN = ("from verlet_numba.kernels.caller import twice_and_one as f\n"
       "print(f(3.0), sum(f.from_python.stats.cache_hits.values()), sum(f.from_python.stats.cache_misses.values()))")


@pytest.fixture
def package(tmp_path):
    """A package of the same name: _jit.py with what it needs, a kernel, and in another file the kernel that it calls."""
    folder = tmp_path / "verlet_numba"
    kernels = folder / "kernels"
    kernels.mkdir(parents=True)
    for name in ("_jit.py", "_version.py"):
        shutil.copy(PACKAGE / name, folder)
    for place in (folder, kernels):
        (place / "__init__.py").touch()
    (kernels / "callee.py").write_text(CALLEE.format(factor=2.0))
    (kernels / "caller.py").write_text(CALLER)
    return folder


def run(package):
    """What the kernel gives, cache hits, misses, in a process of its own; and the files of the cache."""
    cache = package.parent / "cache"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": str(package.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run([sys.executable, "-c", RUN], env=environment, cwd=package.parent, capture_output=True, text=True,
                          check=True)
    value, hits, misses = done.stdout.split()
    return float(value), int(hits), int(misses), sorted(str(path) for path in cache.rglob("*.nb?"))


def test_an_edited_callee_is_compiled_anew_and_an_unedited_one_is_not(package):
    value, hits, misses, files = run(package)
    assert (value, hits, misses) == (7.0, 0, 1)
    assert files
    value, hits, misses, again = run(package)
    assert (value, hits, misses) == (7.0, 1, 0)
    assert again == files
    (package / "cli.py").touch()            # no kernel depends on it
    assert run(package) == (7.0, 1, 0, files)
    (package / "kernels" / "callee.py").write_text(CALLEE.format(factor=5.0))
    value, hits, misses, after = run(package)
    assert (value, hits, misses) == (16.0, 0, 1)
    assert len(after) == 2 * len(files)


def test_the_fingerprint_knows_every_source_of_kernels_and_the_environment(package, monkeypatch):
    first = _jit.fingerprint(package)
    (package / "cli.py").touch()
    assert _jit.fingerprint(package) == first
    (package / "kernels" / "other.py").touch()
    second = _jit.fingerprint(package)
    (package / "kernels" / "other.py").write_text("x = 1\n")
    third = _jit.fingerprint(package)
    monkeypatch.setattr(_jit.np, "__version__", "0.0")
    assert len({first, second, third, _jit.fingerprint(package)}) == 4


def test_old_folders_go_and_what_is_not_ours_stays(tmp_path):
    folders = [tmp_path / f"{k:020d}" for k in range(8)]
    for age, folder in enumerate(folders):
        folder.mkdir()
        os.utime(folder, (1e9 + age, 1e9 + age))
    for other in ("mine", "x" * 21):
        (tmp_path / other).mkdir()
    (tmp_path / ("f" * 20)).touch()
    _jit._prune(tmp_path, tmp_path / ("n" * 20))
    kept = {path.name for path in tmp_path.iterdir()}
    assert kept == {"mine", "x" * 21, "f" * 20} | {folder.name for folder in folders[-(_jit.FOLDERS_KEPT - 1):]}
    _jit._prune(tmp_path / "missing", tmp_path)


def test_kernels_stand_where_the_fingerprint_looks():
    compiled = [path for path in PACKAGE.rglob("*.py")
                if re.search(r"_jit import .*\b(kernel|entry|formula|inlined|scan)\b", path.read_text())]
    assert len(compiled) > 40
    assert {path.relative_to(PACKAGE).parts[0] for path in compiled} <= set(_jit.COMPILED)


def test_only_one_file_names_numba():
    naming = {path.name for path in PACKAGE.rglob("*.py")
              if re.search(r"^\s*(?:import|from)\s+numba\b|\bn?jit\(|@\w*jit\b|(?<!_)numba\.\w", path.read_text(), re.MULTILINE)}
    assert naming == {"_jit.py"}


def plus_one(x):
    return x + 1


def test_an_index_and_its_machine_code_are_read_and_written_under_one_lock(tmp_path, monkeypatch):
    """Else processes that fill one empty cache load the code of each other's signatures."""
    seen = []

    def watched(name, forbidden):
        original = getattr(IndexDataCacheFile, name)

        def access(self, *arguments):
            with (tmp_path / "lock").open() as other, pytest.raises(BlockingIOError):
                fcntl.flock(other, forbidden | fcntl.LOCK_NB)
            seen.append(name)
            return original(self, *arguments)

        monkeypatch.setattr(IndexDataCacheFile, name, access)

    monkeypatch.setattr(_jit, "CACHE", tmp_path)
    watched("load", fcntl.LOCK_EX)
    watched("save", fcntl.LOCK_SH)
    assert _jit.kernel(plus_one)(1) == 2
    assert _jit.kernel(plus_one)(1) == 2
    assert seen == ["load", "save", "load"]
    with (tmp_path / "lock").open() as other:
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
