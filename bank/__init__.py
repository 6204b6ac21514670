"""The bank of reference problems: every special point of each is known. Tests, scripts and benchmarks run it."""
