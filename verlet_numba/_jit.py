"""The one place that names Numba's flags, and where its machine code is kept.

Strict arithmetic: no fast-math flag at all. A fused multiply-add or a reassociated sum may come out differently in a
vectorised loop body, in its scalar remainder and on another processor. Without them a body gives the same bits alone,
as one lane among a thousand, and on every machine; it costs nothing where division and square root are the bound.

No reference counts (`_nrt`): kernels allocate nothing and hand out no array of their own, so the buffers' owner, who calls
them, keeps all alive. Counting would take a fifth of the time of a heap, and an eighth of the time of compiling it.

Numba's disk cache checks the file of the cached function only: an edited callee in another file would be served stale.
So the cache folder is named after everything that the machine code depends on: the sources of kernels and of what they
call, Numba, NumPy and the processor. An edit anywhere among them gives a new folder.
"""

import contextlib
import fcntl
import hashlib
import os
import platform
import re
import shutil
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core import caching, registry

from verlet_numba._version import digest

config: Any = numba.config
types: Any = numba.types
prange: Any = numba.prange
FunctionCache: Any = caching.FunctionCache
Dispatcher: Any = registry.CPUDispatcher
Function = TypeVar("Function", bound=Callable[..., Any])

FLAGS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": False, "boundscheck": False, "no_cfunc_wrapper": True,
                         "_nrt": False}
COMPILED = ("_jit.py", "buffers", "frame.py", "physics", "kernels", "effects")       # what machine code is made from
FOLDERS_KEPT = 4
OURS = re.compile("[0-9a-f]{20}")        # names of folders, as fingerprints are


def sources(package: Path = Path(__file__).parent) -> str:
    """Hash of all source that machine code is made from."""
    return digest(COMPILED, package)


def fingerprint(package: Path = Path(__file__).parent) -> str:
    """Hash of everything that compiled kernels depend on: their sources, Numba, NumPy and the processor."""
    environment = (numba.__version__, np.__version__, platform.python_version(), llvm.get_host_cpu_name(),
                   llvm.get_host_cpu_features().flatten(), os.environ.get("NUMBA_CPU_NAME", ""))
    return hashlib.sha256(repr((sources(package), environment)).encode()).hexdigest()[:20]


def cache_root() -> Path:
    """Where the folders of machine code stand: a folder of our own in NUMBA_CACHE_DIR, else in the user's cache folder."""
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "verlet-numba"


def _prune(root: Path, current: Path) -> None:
    """Machine code of earlier versions goes: all but the newest few folders of fingerprints."""
    try:
        old = [entry for entry in root.iterdir() if OURS.fullmatch(entry.name) and entry != current and entry.is_dir()]
        for entry in sorted(old, key=lambda entry: entry.stat().st_mtime, reverse=True)[FOLDERS_KEPT - 1:]:
            shutil.rmtree(entry, ignore_errors=True)
    except OSError:
        return  # a folder that another process removes at the same time, or that is not ours to clean


CACHE = cache_root() / fingerprint()
if not CACHE.exists():
    _prune(CACHE.parent, CACHE)


class SharedCache(FunctionCache):  # type: ignore[misc]  # its class has no types
    """Numba's cache of a function, for several processes at once.

    Its index and its machine code are separate files. Two processes that fill them at the same time give one name to the code
    of two signatures, and who has read the index before loads the wrong one. One lock of the folder makes each access whole;
    it ends with the process that holds it.
    """

    def load_overload(self, signature: Any, context: Any) -> Any:
        with locked(fcntl.LOCK_SH):
            return super().load_overload(signature, context)

    def save_overload(self, signature: Any, data: Any) -> None:
        with locked(fcntl.LOCK_EX):
            super().save_overload(signature, data)


@contextlib.contextmanager
def locked(kind: int) -> Iterator[None]:
    """Share the folder of machine code with readers (LOCK_SH) or have it alone (LOCK_EX); not where nothing can be locked."""
    try:
        CACHE.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(CACHE / "lock", os.O_RDWR | os.O_CREAT, 0o666)
    except OSError:                 # a folder that others filled: it is read only
        yield
        return
    try:
        with contextlib.suppress(OSError):
            fcntl.flock(descriptor, kind)
        yield
    finally:
        os.close(descriptor)


clock_gettime = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.CPointer(types.int64)))
"""POSIX: the seconds and nanoseconds of a clock, into the array whose `.ctypes` is the second argument."""


class Kernel(Dispatcher):  # type: ignore[misc]  # as above
    """A function that other compiled ones call. To unpack a call from Python is as much code as many a kernel itself: it is left
    out, and who calls it from Python nevertheless gets the same function compiled with it.
    """

    def add_overload(self, result: Any) -> None:
        self.overloads[tuple(result.signature.args)] = result

    def _compile_for_args(self, *arguments: Any, **named: Any) -> Any:
        return self.from_python

    @cached_property
    def from_python(self) -> Any:
        return compiled(self.py_func, CACHE / "from_python", **self.options)


def kernel(function: Function, **options: Any) -> Function:
    """Compile `function` for other kernels: no GIL, strict arithmetic, machine code kept on disk under the fingerprint."""
    if config.DISABLE_JIT:
        return function
    bare = compiled(function, CACHE, no_cpython_wrapper=True, **options)
    bare.__class__, bare.options = Kernel, options
    return bare  # type: ignore[no-any-return]  # as above


def entry(function: Function) -> Function:
    """Compile a kernel that the program calls from Python."""
    return compiled(function, CACHE)  # type: ignore[no-any-return]  # as above


def inlined(function: Function) -> Function:
    """Compile a function as part of its callers: for what a loop calls for each particle or contact with arrays.

    It must not test an argument for None: that branch is pruned in functions of their own only.
    """
    return kernel(function, inline="always")


def threaded(function: Function) -> Function:
    """Compile a function of which `prange` loops run on several threads, as many as `numba.set_num_threads` says."""
    return kernel(function, parallel=True)


def use_threads(count: int) -> None:
    """Run `prange` loops on so many threads, or as many as there are processors."""
    numba.set_num_threads(min(count, config.NUMBA_NUM_THREADS))


def formula(function: Function) -> Function:
    """Compile a scalar formula that kernels inline; it needs no disk cache of its own."""
    return kernel(function, cached=False)


def scan(function: Function) -> Function:
    """Compile a search for the greatest of finite numbers: it is exact in any order, so lanes of a vector may share it.

    The only licence is that no operand is a NaN and that zeros have no sign; sums are not reordered.
    """
    return kernel(function, cached=False, fastmath={"nnan", "nsz"})


def compiled(function: Function, folder: Path, cached: bool = True, **options: Any) -> Any:
    """Numba reads its cache folder from its configuration while decorating, so that is where it is set."""
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder)
    dispatcher = numba.njit(**FLAGS | options)(function)
    try:
        if cached:
            dispatcher._cache = SharedCache(function)
    finally:
        config.CACHE_DIR = before
    return dispatcher
