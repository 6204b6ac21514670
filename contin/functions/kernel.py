"""Kernels: Python functions that run as machine code. This file knows no compiler; it is loaded where one is needed.

A kernel is a Python function whose annotations are its signature:

    @kernel
    def scale(factor: float, x: Vector) -> None:
        for i in range(x.size):
            x[i] *= factor

Its machine code is read from the cache where it is defined. Otherwise `contin.functions.compiler` makes it when the kernel is
called for the first time, and keeps it. `contin.functions.kernel_parts` has the types of arguments, and what kernels call.
"""

from __future__ import annotations

import functools
import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, overload

import llvmlite
import numpy as np

from contin.functions import machine_code
from contin.functions.fingerprint import Fingerprint, contents

_Function = TypeVar("_Function", bound=Callable[..., Any])


class Kernel:
    """A kernel whose machine code was not in the cache when it was defined.

    Parameters
    ----------
    function : callable
        The Python function.
    reorder : bool
        As in `kernel`.
    key : str, optional
        A fingerprint of the function; by default that of the file it stands in.
    """

    def __init__(self, function: Callable[..., Any], reorder: bool, key: str = "") -> None:
        functools.update_wrapper(self, function)
        self.function, self.reorder, self._given = function, reorder, key
        self.name = f"{function.__module__}.{function.__qualname__}"

    @functools.cached_property
    def key(self) -> str:
        """The name of its machine code in the cache: a fingerprint of all that the code depends on."""
        fingerprint = Fingerprint()
        own = self._given or contents(Path(self.function.__code__.co_filename))
        fingerprint.note(self.name, self.reorder, own, *_surroundings())
        return fingerprint.text()[:32]

    def stored(self) -> Callable[..., Any] | None:
        """Return the function that runs the machine code in the cache; None where there is none that can be used."""
        return machine_code.stored(self.key, self.name, self.function.__doc__)

    @functools.cached_property
    def compiled(self) -> Callable[..., Any]:
        """The function that runs the machine code; it is made where the cache has none."""
        found = self.stored()
        if found is not None:
            return found
        from contin.functions import compiler  # numba takes .3 s, and is needed the first time only

        code = compiler.machine_code(self.function, self.reorder, machine_code.ENTRY + self.key)
        machine_code.keep(self.key, code)
        return machine_code.loaded(code, self.name, self.function.__doc__)

    def __call__(self, *arguments: Any) -> Any:
        """Run the machine code."""
        return self.compiled(*arguments)


@overload
def kernel(function: _Function) -> _Function: ...


@overload
def kernel(*, reorder: bool = True) -> Callable[[_Function], _Function]: ...


def kernel(function: Any = None, *, reorder: bool = True) -> Any:
    """Let a function run as machine code, with the types in its annotations.

    These are ``int``, ``float``, ``None``, the arrays above, and named tuples of them. Division by zero gives inf. Sums are
    evaluated in any order, so that loops become vector instructions; without ``reorder`` sums and products are evaluated one by
    one as they stand.
    """
    if function is None:
        return functools.partial(kernel, reorder=reorder)
    pending = Kernel(function, reorder)
    return pending.stored() or pending


@functools.cache
def _surroundings() -> tuple[str, ...]:
    """Return what all machine code depends on: the engine's files that kernels and compiler consist of, and the machine."""
    here = Path(__file__).parent
    files = sorted([*here.glob("*.py"), *(here.parent / "linalg").glob("*.py")])
    numba = importlib.util.find_spec("numba")  # its version stands in a file; to ask for it would take 20 ms
    release = contents(Path(str(numba.origin)).with_name("_version.py")) if numba is not None else ""
    return contents(*files), sys.version, release, llvmlite.__version__, np.__version__, *machine_code.machine()
