"""numba's ``njit`` with a cache on disk that can only help: what it cannot read is compiled anew."""

from __future__ import annotations

import contextlib
import functools
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, overload

import numba
from numba.core import sigutils
from numba.core.caching import FunctionCache, IndexDataCacheFile


class _ForgivingCache(FunctionCache):
    """Machine code of one function on disk.

    A power cut may leave half a file, a quota may be used up. And processes that compile at the same time may take the same
    name for the code of two signatures (numba writes its index without a lock), so what was loaded is looked at.

    The engine's kernels consist of `contin._vector` too: numba looks at the file of a function only, so that a change there
    would go unnoticed.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        if function.__module__.startswith("contin."):
            vector = (Path(__file__).parent.parent / "linalg" / "vector.py").stat()
            stamp = (*self._impl.locator.get_source_stamp(), vector.st_mtime, vector.st_size)
            self._cache_file = IndexDataCacheFile(self._cache_path, self._impl.filename_base, stamp)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            found = super().load_overload(sig, target_context)
        except Exception:  # whatever unpickling garbage raises
            with contextlib.suppress(OSError):
                self.flush()
            return None
        args, _ = sigutils.normalize_signature(sig)
        return found if found is not None and tuple(found.signature.args) == tuple(args) else None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _not_kept(str(self.cache_path), error.strerror or str(error))


@functools.cache
def _not_kept(folder: str, reason: str) -> None:
    """Say, once, why compiled code is not kept."""
    print(
        f"contin: compiled code is not kept in {folder} ({reason}); set CONTIN_CACHE_DIR and NUMBA_CACHE_DIR", file=sys.stderr
    )


#: Options of the engine's kernels: division by zero gives inf; sums in any order, so that loops become vector instructions.
KERNEL: dict[str, Any] = {"cache": True, "error_model": "numpy", "nogil": True, "fastmath": {"contract", "reassoc"}}

_Function = TypeVar("_Function", bound=Callable[..., Any])


@overload
def njit(signature: _Function, **options: Any) -> _Function: ...


@overload
def njit(signature: str | None = None, *, cache: bool = False, **options: Any) -> Callable[[_Function], _Function]: ...


def njit(signature: str | Callable[..., Any] | None = None, *, cache: bool = False, **options: Any) -> Any:
    """``numba.njit``, with that cache where ``cache`` is asked for."""
    if callable(signature):
        return numba.njit(signature, **options)

    def compiled(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(function, **options)
        if cache:
            try:
                dispatcher._cache = _ForgivingCache(function)
            except RuntimeError as error:  # numba found no folder that it may write to
                _not_kept("any folder", str(error).splitlines()[0])
        if signature is not None:
            dispatcher.compile(signature)
            dispatcher.disable_compile()
        return dispatcher

    return compiled
