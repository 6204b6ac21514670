"""Machine code on disk, and in memory as Python functions, without a compiler.

The code of a kernel is an object file. It holds a function that Python calls like one of its own: it checks its arguments,
reads the addresses and shapes of arrays, and calls the kernel. `contin.kernels.compiler` writes it. Wheels bring these files
linked to a shared library; what is not in there is made where it is wanted, and kept in the cache.

A file in the cache is used only where it is whole, of the wanted key, and finds all functions of other libraries that it calls.
The cache can only help: a file that cannot be read, written or trusted costs time, never an answer.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import json
import os
import platform
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from contin.errors import ContinError
from contin.files import write_whole

#: The end of every message about a cache that cannot be written.
_ADVICE = "set CONTIN_CACHE_DIR to a folder that can be written"


def cache_directory() -> Path:
    """Return the folder for compiled kernels: ``CONTIN_CACHE_DIR``, else the user's cache directory, else a temporary one.

    Examples
    --------
    >>> cache_directory().is_dir()
    True
    """
    chosen = os.environ.get("CONTIN_CACHE_DIR")
    if not chosen:
        from platformdirs import user_cache_dir

        chosen = os.path.join(user_cache_dir("contin", appauthor=False), "problems")
    try:
        os.makedirs(chosen, exist_ok=True)
        if os.access(chosen, os.W_OK):
            return Path(chosen)
    except OSError:
        pass
    return _temporary_directory()


@functools.cache
def _temporary_directory() -> Path:
    try:
        path = Path(tempfile.mkdtemp(prefix="contin-"))
    except OSError as error:
        raise ContinError(f"no place for compiled code: {error.strerror}; {_ADVICE}") from error
    print(f"contin: no writable cache, compiling into {path}; set CONTIN_CACHE_DIR to keep it", file=sys.stderr)
    return path


#: The name of the function in an object file that Python calls, followed by the key of the code.
ENTRY = "contin_"
#: Behind the name of that function, the name of the one that other kernels call.
INNER = "_inner"
#: Python calls it with an array of arguments and names, which are not read (METH_FASTCALL, METH_KEYWORDS).
_CALLED_WITH_ARRAY = 0x0080 | 0x0002
#: The function of Python that has the same arguments: it calls the first one.
_CALL = ctypes.cast(ctypes.pythonapi.PyObject_Vectorcall, ctypes.c_void_p).value


class Code(NamedTuple):
    """The machine code of a kernel.

    ``entry`` is the name of the function that Python calls, ``foreign`` are names of functions in other libraries.
    """

    entry: str
    foreign: tuple[str, ...]
    object: bytes


def machine() -> tuple[str, str]:
    """Return the system and the processor that machine code is made for.

    The processor is not this one, but a fixed one of its kind, so that kernels give the same bits on all of them: x86-64-v3
    (with AVX2 and fused multiply-add, from 2013 on), the first x86-64 where that does not run, or LLVM's generic one elsewhere.
    ``CONTIN_PROCESSOR`` names another one. Raises ContinError where it names none of these three.
    """
    kind, given = platform.machine().lower(), os.environ.get("CONTIN_PROCESSOR", "")
    if given and given not in _PROCESSORS:
        raise ContinError(f"CONTIN_PROCESSOR: {given!r} must be one of {', '.join(_PROCESSORS)}")
    here = "generic"
    if kind in ("x86_64", "amd64"):
        here = "x86-64-v3" if _features() >= _VERSION_3 else "x86-64"
    return f"{sys.platform}-{kind}", given or here


def _features() -> set[str]:
    """Return what this processor has, by the names of Linux; nothing where the system is another one and LLVM is not there."""
    with contextlib.suppress(OSError, StopIteration):
        lines = Path("/proc/cpuinfo").read_text(encoding="ascii", errors="replace").splitlines()
        return set(next(line for line in lines if line.startswith("flags")).split())
    with contextlib.suppress(ImportError):
        found = _llvm().get_host_cpu_features()
        return {_LINUX.get(name, name) for name in found if found[name]}
    return set()


#: What machine code is made for.
_PROCESSORS = "x86-64", "x86-64-v3", "generic"
#: The features that x86-64-v3 has and x86-64 has not.
_VERSION_3 = {
    "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "popcnt", "sse4_2", "ssse3", "cx16", "lahf_lm", "xsave",
}  # fmt: skip
#: LLVM's names of features that have other ones in Linux.
_LINUX = {"bmi": "bmi1", "lzcnt": "abm", "sse4.2": "sse4_2", "sahf": "lahf_lm"}


def _llvm() -> Any:
    """Return the library that loads object files; a wheel's machine code needs none."""
    import llvmlite.binding

    return llvmlite.binding


def shipped(entry: str, name: str, doc: str | None) -> Callable[..., Any] | None:
    """Return a function from the library that came with the package; None where that does not have it."""
    found = getattr(_library(), entry, None)
    return None if found is None else _called(ctypes.cast(found, ctypes.c_void_p).value, name, doc)


@functools.cache
def _library() -> ctypes.CDLL | None:
    """Return the library of machine code that came with the package, None where none runs here."""
    path = Path(__file__).with_name(f"{LIBRARY}{machine()[1]}.so")
    with contextlib.suppress(OSError):
        return ctypes.CDLL(str(path), ctypes.RTLD_GLOBAL)  # kernels that are made later may call those in it
    return None


#: The name of a library of machine code, followed by the processor.
LIBRARY = "kernels-"


def stored(key: str) -> Code | None:
    """Return the code of this key in the cache; None where there is none that can be used."""
    try:
        head, code = _unpacked((cache_directory() / f"k{key}.bin").read_bytes())
    except (OSError, ContinError, ValueError):
        return None
    found = Code(head["entry"], tuple(head["foreign"]), code)
    return found if head["key"] == key and not _missing(found, kernels=False) else None


def _missing(code: Code, kernels: bool) -> list[str]:
    """Return functions that a code calls and that this process does not have; other ``kernels`` may be loaded later."""
    _engine()  # loads the functions of this process
    names = [name for name in code.foreign if kernels or not name.startswith(ENTRY)]
    return [name for name in names if _llvm().address_of_symbol(name) is None]


def keep(key: str, code: Code) -> None:
    """Keep the code of a kernel in the cache; a line on stderr says so where that fails."""
    folder = cache_directory()
    head = json.dumps({"key": key, "entry": code.entry, "foreign": code.foreign}).encode()
    body = len(head).to_bytes(8, "little") + head + code.object
    try:
        write_whole(folder / f"k{key}.bin", hashlib.sha256(body).digest() + body)
    except OSError as error:
        _warn_not_kept(str(folder), error.strerror or str(error))


@contextlib.contextmanager
def claim(key: str) -> Iterator[bool]:
    """Hold the right to make the machine code of this key; False where another process holds it."""
    from filelock import FileLock, Timeout  # takes 25 ms, and is needed the first time only

    try:
        lock = FileLock(cache_directory() / f"k{key}.lock", timeout=0)
        lock.acquire()
    except Timeout:
        yield False
        return
    except (OSError, NotImplementedError):  # a folder that has no locks: the work is done twice
        yield True
        return
    try:
        yield True
    finally:
        lock.release()


def _unpacked(data: bytes) -> tuple[dict[str, Any], bytes]:
    """Return the head and the object code of a file; raise ValueError where the file is not whole."""
    body = memoryview(data)[32:]
    if hashlib.sha256(body).digest() != data[:32]:
        raise ValueError("the file is not whole")
    size = int.from_bytes(body[:8], "little")
    return json.loads(bytes(body[8 : 8 + size])), bytes(body[8 + size :])


class _Method(ctypes.Structure):
    """Python's PyMethodDef."""

    _fields_ = [("name", ctypes.c_char_p), ("function", ctypes.c_void_p), ("flags", ctypes.c_int), ("doc", ctypes.c_char_p)]


#: Machine code is loaded by one thread at a time.
_LOADING = threading.RLock()
#: What functions point to, as long as the process lives.
_KEPT: list[_Method] = []


def loaded(code: Code, name: str, doc: str | None) -> Callable[..., Any]:
    """Return machine code as a Python function; ``name`` is that of its module and its own.

    Raises ContinError where it calls a function that this process does not have.
    """
    engine = _engine()
    missing = _missing(code, kernels=True)
    if missing:
        raise ContinError(f"{name}: the function {missing[0]}, which its machine code calls, is not there")
    engine.add_object_file(_llvm().object_file.ObjectFileRef.from_data(code.object))
    engine.finalize_object()
    _llvm().add_symbol(code.entry + INNER, engine.get_function_address(code.entry + INNER))
    return _called(engine.get_function_address(code.entry), name, doc)


def _called(address: int | None, name: str, doc: str | None, call: Callable[..., Any] | None = None) -> Callable[..., Any]:
    """Return the function at an address as a Python function; without one, ``call`` is called the first time and names it."""
    module, _, own = name.rpartition(".")
    method = _Method(own.encode(), address or _CALL, _CALLED_WITH_ARRAY, (doc or "").encode())
    _KEPT.append(method)
    make = ctypes.pythonapi.PyCFunction_NewEx
    make.restype, make.argtypes = ctypes.py_object, [ctypes.c_void_p, ctypes.py_object, ctypes.py_object]
    ctypes.pythonapi.PyCFunction_GetFunction.restype = ctypes.c_void_p
    return make(ctypes.addressof(method), _Self((np.ndarray, None, TypeError, call, method)), module)


class _Self(tuple[Any, ...]):
    """What a function of machine code is called with; it stands for the function until its machine code is there."""

    __slots__ = ()

    def __call__(self, *arguments: object) -> Any:
        """Run the machine code, and let the function be it from now on."""
        with _LOADING:
            found = self.kernel.compiled
        self[4].function = ctypes.pythonapi.PyCFunction_GetFunction(ctypes.py_object(found))
        return found(*arguments)

    @property
    def kernel(self) -> Any:
        """The `contin.kernels.kernel.Kernel`."""
        return self[3]


def late(kernel: Any, name: str, doc: str | None) -> Callable[..., Any]:
    """Return the function that runs ``kernel.compiled``, which is asked for when it is called for the first time."""
    return _called(None, name, doc, kernel)


@functools.cache
def _engine() -> Any:
    """Return the loader of object files."""
    llvm = _llvm()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), llvm.Target.from_default_triple().create_target_machine())


@functools.cache
def _warn_not_kept(folder: str, reason: str) -> None:
    """Say once why compiled code is not kept."""
    print(f"contin: compiled code is not kept in {folder} ({reason}); set CONTIN_CACHE_DIR", file=sys.stderr)
