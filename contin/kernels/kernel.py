"""Kernels: Python functions that run as machine code. This file knows no compiler; it is loaded where one is needed.

A kernel is a Python function whose annotations are its signature:

    @kernel
    def scale(factor: float, x: Vector) -> None:
        for i in range(x.size):
            x[i] *= factor

Its machine code is read from the cache when the kernel is called for the first time. Where it is not there,
`contin.kernels.compiler` makes it, and it is kept. `contin.kernels.kernel_parts` has the types of arguments, and what
kernels call.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import importlib.util
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar, overload

import numpy as np

from contin import threads
from contin.errors import ContinError
from contin.kernels import machine_code
from contin.kernels.kernel_parts import length, parts
from contin.kernels.machine_code import cache_directory

_Function = TypeVar("_Function", bound=Callable[..., Any])


class Kernel:
    """A kernel, and its machine code when that is needed.

    Parameters
    ----------
    function : callable
        The Python function.
    reorder, last : bool
        As in `kernel`.
    """

    def __init__(self, function: Callable[..., Any], reorder: bool, last: bool = False) -> None:
        self.function, self.reorder, self.last, self.__module__ = function, reorder, last, function.__module__
        self.name = f"{function.__module__}.{function.__qualname__}"

    @functools.cached_property
    def parts(self) -> list[Any]:
        """What it is made of."""
        return parts(self.function)

    @functools.cached_property
    def files(self) -> frozenset[Path]:
        """Files that its machine code is made of: those in which it, its helpers and the kernels that it calls stand."""
        modules = {self.function.__module__, *(part.__module__ for part in self.parts if not isinstance(part, int | float))}
        files = {Path(str(sys.modules[module].__file__)) for module in modules}
        return frozenset(files.union(*(part.files for part in self.parts if isinstance(part, Kernel))))

    @functools.cached_property
    def entry(self) -> str:
        """The name of the function that its machine code holds for Python: a fingerprint of what it is made of."""
        numbers = [part for part in self.parts if isinstance(part, int | float)]
        called = [part.entry for part in self.parts if isinstance(part, Kernel)]  # with the numbers that these read
        held = sorted(map(contents, self.files))
        return machine_code.ENTRY + _fingerprint(
            self.name, self.reorder, numbers, called, held, _made_by(), object.__basicsize__
        )

    @functools.cached_property
    def key(self) -> str:
        """The name of its machine code in the cache: a fingerprint of all that the code depends on."""
        return _fingerprint(self.entry, *_surroundings())

    @functools.cached_property
    def shipped(self) -> Callable[..., Any] | None:
        """The function that runs the machine code that came with the package; None where there is none."""
        return machine_code.shipped(self.entry, self.name, self.function.__doc__)

    @functools.cached_property
    def compiled(self) -> Callable[..., Any]:
        """The function that runs the machine code; that of the kernels that it calls is loaded before."""
        if self.shipped is not None:
            return self.shipped
        if not _has_compiler():
            raise ContinError(_NO_COMPILER)
        code = self.code
        for part in self.parts:
            if isinstance(part, Kernel):
                _ = part.compiled
        return machine_code.loaded(code, self.name, self.function.__doc__)

    @functools.cached_property
    def code(self) -> machine_code.Code:
        """The machine code; it is made where the cache has none."""
        found = machine_code.stored(self.key)
        if found is not None:
            return found
        _share_work()
        others = _by_length(other for other in _shared() if other is not self)
        while True:
            found = self._made()
            if found is not None:
                return found
            if others:  # another process makes this one
                others.pop(0).prepare()
            else:
                time.sleep(_WAIT)

    def prepare(self) -> None:
        """Make the machine code, unless the cache has it, or another process is making it."""
        found = self._made()
        if found is not None:
            vars(self).setdefault("code", found)

    def _made(self) -> machine_code.Code | None:
        """Return the machine code from the cache, or make it; None where another process is making it."""
        with machine_code.claim(self.key) as mine:
            if not mine:
                return None
            found = machine_code.stored(self.key)
            if found is None:
                from contin.kernels import compiler  # numba takes .3 s, and is needed the first time only

                found = compiler.machine_code(self.function, self.reorder, self.entry)
                machine_code.keep(self.key, found)
            return found


@overload
def kernel(function: _Function) -> _Function: ...


@overload
def kernel(*, reorder: bool = True, last: bool = False) -> Callable[[_Function], _Function]: ...


def kernel(function: Any = None, *, reorder: bool = True, last: bool = False) -> Any:
    """Let a function run as machine code, with the types in its annotations.

    These are ``int``, ``float``, ``None``, the arrays above, and named tuples of them. Division by zero gives inf. Sums are
    evaluated in any order, so that loops become vector instructions; without ``reorder`` sums and products are evaluated one by
    one as they stand. One that only some kinds of problem need is made ``last`` where all are made.

    Kernels call kernels, by a global name or as ``module.name``. What they call is not compiled again, and keeps its options.
    """
    if function is None:
        return functools.partial(kernel, reorder=reorder, last=last)
    KERNELS.append(Kernel(function, reorder, last))
    return machine_code.late(KERNELS[-1], KERNELS[-1].name, function.__doc__)


#: All kernels that are defined.
KERNELS: list[Kernel] = []
#: Seconds between two looks whether another process has made what this one waits for.
_WAIT = 0.05
#: Kernels of these modules are made by two processes.
_PACKAGE = __name__.partition(".")[0] + "."


def _shared() -> list[Kernel]:
    """Return the engine's kernels that are not made yet; others may be wrong, and are made where they are called."""
    own = [each for each in KERNELS if each.name.startswith(_PACKAGE) and "code" not in vars(each)]
    return [each for each in own if machine_code.stored(each.key) is None]


@functools.cache
def _share_work() -> subprocess.Popen[bytes] | None:
    """Start a process that makes machine code of the package's kernels as well; say that there is something to wait for."""
    modules = dict.fromkeys(each.function.__module__ for each in _shared())
    if not modules:
        return None
    if sys.stderr is not None and sys.stderr.isatty():
        text = "contin: compiling the engine for this machine, once; this takes some 10 s"
        print(f"\r{text:<79}", file=sys.stderr)  # a line of progress may stand there
    if threads.count() < 2 or not sys.executable:
        return None
    quiet: Any = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
    with contextlib.suppress(OSError):  # this process makes all of it, then
        environment = {**os.environ, "CONTIN_CACHE_DIR": str(cache_directory())}
        return subprocess.Popen([sys.executable, "-c", _PREPARE, *sys.path, _END, *modules], env=environment, **quiet)
    return None


#: Ends the path among the arguments of that process; a path holds "" for the current folder.
_END = "--"
#: The program of that process; its arguments are this one's path, and modules.
_PREPARE = f"""
import sys
split = sys.argv.index({_END!r}, 1)
sys.path[:] = sys.argv[1:split]
from contin.kernels.kernel import prepare
prepare(sys.argv[split + 1:])
"""


def prepare(modules: Sequence[str]) -> None:
    """Make the machine code of the kernels that modules define."""
    for module in modules:
        importlib.import_module(module)
    for each in _by_length(KERNELS):
        each.prepare()


def _by_length(kernels: Iterable[Kernel]) -> list[Kernel]:
    """Return kernels in the order in which two processes make them: long ones first, then those of some kinds of problem."""
    return sorted(kernels, key=lambda each: (each.last, -length(each.function)))


@functools.cache
def contents(*files: Path) -> str:
    """Return a fingerprint of what files hold."""
    return hashlib.sha256(b"\0".join(file.read_bytes() for file in files)).hexdigest()


def _fingerprint(*parts: object) -> str:
    """Return a fingerprint of what has a fixed representation."""
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:32]


#: Files that decide what machine code is made of, besides the `Kernel.files`.
_MADE_BY = (
    "kernels/compiler", "kernels/kernel", "kernels/kernel_parts", "kernels/machine_code", "functions/primitives",
    "functions/program",
)  # fmt: skip


@functools.cache
def _made_by() -> str:
    """Return a fingerprint of the engine's files that kernels and compiler consist of."""
    return contents(*(Path(__file__).parent.parent / f"{name}.py" for name in _MADE_BY))


@functools.cache
def _surroundings() -> tuple[str, ...]:
    """Return what machine code depends on besides its source: the compiler, the libraries, and the machine."""
    import llvmlite

    numba = importlib.util.find_spec("numba")  # its version stands in a file; to ask for it would take 20 ms
    release = contents(Path(str(numba.origin)).with_name("_version.py")) if numba is not None else ""
    return sys.version, release, llvmlite.__version__, np.__version__, *machine_code.machine()


@functools.cache
def _has_compiler() -> bool:
    """Return whether numba is installed, with which machine code is made."""
    return importlib.util.find_spec("numba") is not None


#: Without numba, where a kernel is wanted that the package's library does not have.
_NO_COMPILER = (
    "contin: no machine code for this machine and this version of Python came with the package, and numba, which makes it, "
    "is not installed: pip install numba"
)
