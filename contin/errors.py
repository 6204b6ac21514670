"""The exceptions of contin: one sentence each, fit to be shown to a user as it is."""

from __future__ import annotations


class ContinError(Exception):
    """Base of all errors raised on purpose."""


class ProblemError(ContinError, ValueError):
    """The statement of a problem is not usable; the message names the field, the value and what is allowed."""


class CompilationError(ProblemError):
    """A function cannot be compiled, or differentiated symbolically."""


class InterpretedWarning(UserWarning):
    """A function cannot be compiled and is evaluated in Python; the message says why, and what it costs."""


class ConvergenceError(ContinError, ArithmeticError):
    """Newton's method did not converge; the message holds the last residuals and what to change."""
