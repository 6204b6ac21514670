"""The exceptions of contin: one sentence each, fit to be shown to a user as it is."""

from __future__ import annotations


class ContinError(Exception):
    """Base of all errors raised on purpose."""


class ProblemError(ContinError, ValueError):
    """The statement of a problem is not usable; the message names the field, the value and what is allowed."""


class ConvergenceError(ContinError, ArithmeticError):
    """Newton's method did not converge; the message holds the last residuals and what to change."""
