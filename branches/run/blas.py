"""One thread of BLAS: more slow down matrices as small as those of a strip, and change their bits."""

import functools
import sys
from contextlib import AbstractContextManager

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager:
    """Return a context in which BLAS uses one thread."""
    return _found("scipy.linalg" in sys.modules).limit(limits=1, user_api="blas")


@functools.cache
def _found(with_scipy: bool) -> ThreadpoolController:
    """Return the libraries of BLAS, found once without and once ``with_scipy``, which brings its own: it takes 1 ms."""
    return ThreadpoolController()
