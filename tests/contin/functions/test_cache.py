"""Compiled code on disk: whatever state the files are in, and wherever they may not be, the answer is right."""

import errno
import importlib.util
import itertools
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numba
import pytest
from numba.core.caching import IndexDataCacheFile

from contin import ContinError
from contin.functions import cache, compiler
from contin.functions.compiler import _warn_not_kept

#: The functions that a kernel calls have one version for each kind of argument, in one index.
KERNEL = """
from contin.functions.compiler import njit

@njit(cache=True)
def helper(x):
    return x + 1

@njit("f8(f8)", cache=True)
def kernel(x):
    return 2 * helper(x) + helper(1)
"""
numbers = itertools.count()


@pytest.fixture
def kernel(tmp_path, monkeypatch):
    """A function that imports the module above as a new process would; its compiled code lies in ``tmp_path``."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    path = tmp_path / "kernel_module.py"
    path.write_text(KERNEL)

    def load():
        spec = importlib.util.spec_from_file_location(f"kernel_module_{next(numbers)}", path)
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, spec.name, module)
        spec.loader.exec_module(module)
        return module.kernel

    return load


def _files(folder: Path, suffix: str) -> list[Path]:
    return sorted((folder / "__pycache__").glob(f"*{suffix}"))


def test_files_cut_anywhere_are_replaced(kernel, tmp_path):
    assert kernel()(3.0) == 10.0
    for suffix in (".nbi", ".nbc"):
        for length in (0, 1, 20, 300):
            for path in _files(tmp_path, suffix):
                os.truncate(path, min(length, path.stat().st_size))
            assert kernel()(3.0) == 10.0
    assert sum(kernel()._cache_hits.values()) == 1  # and what replaced them is used


def test_code_of_another_signature_under_the_same_name_is_not_taken(kernel, tmp_path):
    """Two processes that compile at once may leave the entry of one signature with the code of the other."""
    kernel()
    one, two = (path for path in _files(tmp_path, ".nbc") if ".helper" in path.name)
    first, second = one.read_bytes(), two.read_bytes()
    one.write_bytes(second)
    two.write_bytes(first)
    for path in _files(tmp_path, ".nbi"):
        if ".kernel" in path.name:
            path.unlink()
    assert kernel()(3.0) == 10.0


def test_code_of_another_version_of_numba_is_not_taken(kernel, tmp_path, monkeypatch):
    monkeypatch.setattr(numba, "__version__", "0.0.1")
    kernel()
    monkeypatch.undo()
    assert IndexDataCacheFile(str(tmp_path / "__pycache__"), _files(tmp_path, ".nbi")[0].stem, None)._load_index() == {}


def test_a_full_disk_costs_a_line_and_the_cache(kernel, monkeypatch, capsys):
    def full(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(IndexDataCacheFile, "save", full)
    _warn_not_kept.cache_clear()
    assert kernel()(3.0) == 10.0
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "No space left on device" in said and "CONTIN_CACHE_DIR" in said


def test_code_finds_a_place_or_says_what_to_set(tmp_path, monkeypatch, capsys):
    write = cache.write_whole
    monkeypatch.setenv("CONTIN_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(cache, "_temporary_directory", lambda: tmp_path)

    def full(path, data):
        if path.parent == tmp_path / "cache":
            raise OSError(errno.EDQUOT, "Disk quota exceeded")
        write(path, data)

    monkeypatch.setattr(cache, "write_whole", full)
    assert cache.write_source("x.py", "1") == tmp_path / "x.py"
    monkeypatch.setattr(cache, "_temporary_directory", lambda: tmp_path / "cache")
    with pytest.raises(ContinError, match="Disk quota exceeded; set CONTIN_CACHE_DIR to a folder that can be written"):
        cache.write_source("x.py", "1")


PROBLEM = """
import contin
problem = contin.BoundaryValueProblem(
    lambda t, u, p: (u.v, -p.lam * u.u), lambda a, b, p: (a.u, b.u - 1), ["u", "v"], {"lam": 1.0}
)
print(repr(contin.solve(problem, [0, 1], intervals=4).x.sum()))
"""


def test_processes_that_compile_the_same_problem_at_once(tmp_path):
    environment = {**os.environ, "CONTIN_CACHE_DIR": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    started = [
        subprocess.Popen(
            [sys.executable, "-c", PROBLEM], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        for _ in range(3)
    ]
    ended = [process.communicate(timeout=120) for process in started]
    assert len(set(ended)) == 1 and ended[0][1] == ""


SAME_NAMES = """
import sys
from contin import BoundaryValueProblem, Collocation

def problem(helper):
    def rhs(t, u, p):
        return (helper(u.x),)
    return BoundaryValueProblem(rhs, lambda a, b, p: (a.x - 1,), ["x"], {"k": 1.0})

def one():
    def helper(x):
        return 10 * x
    return problem(helper)

def two():
    def helper(x):
        return x + 20
    return problem(helper)

for name in sys.argv[1:]:
    system = Collocation(globals()[name](), [0, 1], 2, ["k"], {})
    print(system.residual(system.pack([[3.0]] * 3, {"k": 1.0}))[0])
"""


def test_functions_of_one_name_compiled_by_two_processes_stay_apart(tmp_path):
    """Each compiled by a process of its own, both loaded by a third: -h f(3) is -30 and -23."""
    script = tmp_path / "same_names.py"
    script.write_text(SAME_NAMES)
    environment = {**os.environ, "CONTIN_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": os.pathsep.join(sys.path)}

    def run(*names):
        done = subprocess.run([sys.executable, script, *names], env=environment, capture_output=True, text=True, check=True)
        return [float(line) for line in done.stdout.split()]

    assert run("one") == pytest.approx([-30])
    assert run("two") == pytest.approx([-23])
    assert run("one", "two") == pytest.approx([-30, -23])


def test_an_installation_and_a_home_that_cannot_be_used(tmp_path, monkeypatch, capsys):
    """Neither the package's folder nor a home: kernels and problems go to one temporary folder, and a line says what to set."""
    monkeypatch.setattr(os, "access", lambda path, mode: str(path).startswith(str(tmp_path)))
    monkeypatch.setattr(cache, "_temporary_directory", cache.functools.cache(cache._temporary_directory.__wrapped__))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    for name, value in {"HOME": "/proc/none", "XDG_CACHE_HOME": "", "CONTIN_CACHE_DIR": "", "NUMBA_CACHE_DIR": ""}.items():
        monkeypatch.setenv(name, value)
    compiler._place_cache()
    folder = cache.cache_directory()
    assert folder.parent == tmp_path and os.environ["NUMBA_CACHE_DIR"] == numba.config.CACHE_DIR == str(folder / "engine")
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "set CONTIN_CACHE_DIR to keep it" in said
    monkeypatch.setattr(tempfile, "tempdir", "/proc/none")
    cache._temporary_directory.cache_clear()
    with pytest.raises(ContinError, match="no place for compiled code: .*; set CONTIN_CACHE_DIR"):
        cache.cache_directory()
