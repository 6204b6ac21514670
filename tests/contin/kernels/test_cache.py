"""Compiled code on disk: whatever state the files are in, and wherever they may not be, the answer is right."""

import ctypes
import errno
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from contin import ContinError
from contin.kernels import kernel as kernels
from contin.kernels import machine_code
from contin.kernels import machine_code as cache
from contin.kernels.kernel import Kernel
from contin.kernels.kernel_parts import Matrix, Vector, helper


@helper
def _plus_one(x):
    return x + 1


def _twice(x: Vector, factor: int) -> float:
    """Double the sum."""
    return factor * (_plus_one(x[0]) + _plus_one(1.0))


@pytest.fixture
def kernel(tmp_path, monkeypatch):
    """Return the kernel as a new process would have it; its machine code lies in ``tmp_path``."""
    monkeypatch.setenv("CONTIN_CACHE_DIR", str(tmp_path))
    return lambda: Kernel(_twice, reorder=True)


def stored(kernel):
    """The function of the machine code that the cache has; None without any."""
    code = machine_code.stored(kernel.key)
    return code and machine_code.loaded(code, kernel.name, kernel.function.__doc__)


def _file(folder: Path) -> Path:
    (path,) = folder.glob("k*.bin")
    return path


X = np.array([3.0])


def test_machine_code_is_kept(kernel, tmp_path):
    assert stored(kernel()) is None
    assert kernel().compiled(X, 2) == 12.0
    found = stored(kernel())
    assert found(X, 2) == 12.0
    assert found.__name__ == "_twice" and found.__doc__ == "Double the sum." and found.__module__ == __name__


@pytest.mark.sample(2)
@pytest.mark.parametrize("length", [0, 1, 20, 300, -1])
def test_files_cut_anywhere_are_replaced(kernel, tmp_path, length):
    kernel().compiled(X, 2)
    path = _file(tmp_path)
    whole = path.read_bytes()
    os.truncate(path, length % len(whole))
    assert stored(kernel()) is None
    assert kernel().compiled(X, 2) == 12.0
    assert stored(kernel())(X, 2) == 12.0


def test_a_changed_byte_is_noticed(kernel, tmp_path):
    kernel().compiled(X, 2)
    path = _file(tmp_path)
    data = bytearray(path.read_bytes())
    for place in (0, 40, len(data) // 2, len(data) - 1):
        path.write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
        assert stored(kernel()) is None


def test_code_of_another_key_under_the_same_name_is_not_taken(kernel, tmp_path):
    kernel().compiled(X, 2)
    other = Kernel(_twice, reorder=False)
    _file(tmp_path).rename(tmp_path / f"k{other.key}.bin")
    assert stored(other) is None
    assert other.compiled(X, 2) == 12.0


@pytest.mark.full
def test_a_kernel_that_another_process_makes_is_waited_for(kernel):
    kernel().compiled(X, 2)
    key, path = kernel().key, cache.cache_directory() / f"k{kernel().key}.bin"
    made = path.read_bytes()
    path.unlink()
    with ThreadPoolExecutor() as executor:
        with machine_code.claim(key) as mine:
            waiting = executor.submit(lambda: kernel().compiled(X, 2))
            time.sleep(0.3)
            assert mine and not waiting.done()
            path.write_bytes(made)
        assert waiting.result(timeout=60) == 12.0
    assert path.read_bytes() == made


@pytest.mark.full
def test_the_second_process_makes_kernels_of_modules(tmp_path, monkeypatch):
    (tmp_path / "one_kernel.py").write_text(
        "from contin.kernels.kernel import kernel\n\n@kernel\ndef one(x: int) -> int:\n    return x + 1\n"
    )
    monkeypatch.setenv("CONTIN_CACHE_DIR", str(tmp_path))
    program = [sys.executable, "-c", kernels._PREPARE, "", str(tmp_path), *sys.path, kernels._END, "one_kernel"]
    subprocess.run(program, check=True)
    assert len(list(tmp_path.glob("k*.bin"))) == 1


def test_code_that_calls_a_function_that_is_not_there_is_not_taken(kernel):
    kernel().compiled(X, 2)
    key = kernel().key
    path = cache.cache_directory() / f"k{key}.bin"
    head, code = machine_code._unpacked(path.read_bytes())
    machine_code.keep(key, machine_code.Code(head["entry"], ("no_such_function",), code))
    assert stored(kernel()) is None


def _flat(x: Matrix) -> float:
    return x.reshape(x.size)[0]


def test_code_that_only_a_process_with_numba_can_run_is_refused():
    """It would be made again in every process."""
    with pytest.raises(TypeError, match="calls numba_attempt_nocopy_reshape, which is there only where numba is loaded"):
        Kernel(_flat, reorder=True).compiled(np.eye(2))


def test_the_key_depends_on_the_machine_and_on_versions(monkeypatch):
    """A cache may lie in a home that several machines share. Processors that run the same code share it."""
    keys = {Kernel(_twice, reorder=True).key}
    for target, name, value in (
        (machine_code, "_features", set), (np, "__version__", "0.0.1"), (sys, "version", "2.7"),
    ):  # fmt: skip
        with monkeypatch.context() as patch:
            patch.setattr(target, name, value)
            kernels._surroundings.cache_clear()
            keys.add(Kernel(_twice, reorder=True).key)
    kernels._surroundings.cache_clear()
    assert len(keys) == 4


def test_the_code_does_not_depend_on_the_processor(monkeypatch):
    """Kernels give the same bits on processors with AVX2: they are compiled for x86-64-v3, not for the host."""
    monkeypatch.setattr(platform, "machine", lambda: "x86_64")
    for features, processor in (
        (machine_code._VERSION_3, "x86-64-v3"), ({*machine_code._VERSION_3, "avx512f"}, "x86-64-v3"), ({"avx2"}, "x86-64"),
    ):  # fmt: skip
        monkeypatch.setattr(machine_code, "_features", lambda features=features: features)
        assert machine_code.machine()[1] == processor
    monkeypatch.setenv("CONTIN_PROCESSOR", "x86-64-v4")
    with pytest.raises(ContinError, match="CONTIN_PROCESSOR: 'x86-64-v4' must be one of x86-64, x86-64-v3, generic"):
        machine_code.machine()


@pytest.mark.skipif(not Path("/proc/cpuinfo").exists(), reason="Linux tells what the processor has")
def test_linux_and_llvm_tell_the_same_of_the_processor(monkeypatch):
    told = machine_code._features()
    monkeypatch.setattr(Path, "read_text", lambda *_, **__: "")
    assert machine_code._VERSION_3 & machine_code._features() == machine_code._VERSION_3 & told


@pytest.fixture
def library(kernel, tmp_path, monkeypatch):
    """A library, as wheels have it, with the machine code of the kernel; nothing is in the cache."""
    linker = shutil.which("cc")
    if linker is None or sys.platform != "linux":
        pytest.skip("no compiler to link with, or not Linux")
    (tmp_path / "one.o").write_bytes(kernel().code.object)
    subprocess.run([linker, "-shared", "-o", str(tmp_path / "one.so"), str(tmp_path / "one.o")], check=True)
    _file(tmp_path).unlink()
    found = ctypes.CDLL(str(tmp_path / "one.so"), ctypes.RTLD_GLOBAL)
    monkeypatch.setattr(machine_code, "_library", lambda: found)


def test_machine_code_that_comes_with_the_package_needs_no_compiler(library, kernel, tmp_path, monkeypatch):
    monkeypatch.setattr(kernels, "_has_compiler", lambda: False)
    found = kernel().compiled
    assert found(X, 2) == kernel().compiled(X, 2) == 12.0
    assert found.__name__ == "_twice" and found.__doc__ == "Double the sum."
    assert not list(tmp_path.glob("k*.bin"))


def test_code_of_another_source_is_not_taken_from_the_package(library, monkeypatch):
    other = Kernel(_twice, reorder=False)
    assert other.shipped is None
    assert other.compiled(X, 2) == 12.0
    monkeypatch.setattr(kernels, "_has_compiler", lambda: False)
    with pytest.raises(ContinError, match="numba, which makes it, is not installed: pip install numba"):
        Kernel(_flat, reorder=True).compiled(np.eye(2))


@pytest.mark.sample(3)
@pytest.mark.parametrize(
    "arguments",
    [
        (), (X,), (X, 2, 3), (X, None), ([3.0], 2), (X.astype("f4"), 2), (X.astype(">f8"), 2), (X[None], 2),
        (np.ones(4)[::2], 2), (np.float64(3.0), 2), (X, "2"), (X, 2.5), (X, 2**70),
    ],
)  # fmt: skip
def test_arguments_of_other_types_are_refused(kernel, arguments):
    with pytest.raises((TypeError, OverflowError)):
        kernel().compiled(*arguments)
    assert kernel().compiled(X, np.int64(2)) == 12.0


def test_arrays_that_cannot_be_written_are_refused_where_they_might_be(kernel):
    fixed = X.copy()
    fixed.flags.writeable = False
    with pytest.raises(TypeError):
        kernel().compiled(fixed, 2)


def test_a_full_disk_costs_a_line_and_the_cache(kernel, monkeypatch, capsys):
    def full(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(machine_code, "write_whole", full)
    machine_code._warn_not_kept.cache_clear()
    assert kernel().compiled(X, 2) == 12.0
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "No space left on device" in said and "CONTIN_CACHE_DIR" in said


WITHOUT_NUMBA = """
import sys
exec(open(sys.argv[1]).read())
from contin import solve, trace
print(sorted({"numba", "scipy"} & set(sys.modules)))
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A cache that the processes of several tests share: kernels are compiled into it once."""
    return tmp_path_factory.mktemp("cache")


@pytest.mark.full
def test_a_second_process_needs_no_compiler(folder, tmp_path):
    """Machine code on disk needs neither numba nor SciPy: loading them would take longer than most runs."""
    problem = tmp_path / "problem.py"
    problem.write_text(PROBLEM)
    environment = {**os.environ, "CONTIN_CACHE_DIR": str(folder), "PYTHONPATH": os.pathsep.join(sys.path)}
    lines = [
        subprocess.run(
            [sys.executable, "-c", WITHOUT_NUMBA, problem], env=environment, capture_output=True, text=True, check=True
        ).stdout.split("\n")
        for _ in range(2)
    ]
    assert lines[0][0] == lines[1][0]
    assert "numba" in lines[0][1] and lines[1][1] == "[]"


#: Functions alone: where the engine is imported before, a second process compiles it as well, for each folder.
PROBLEM = """
import numpy as np
from contin.lowlevel import Batch
batch = Batch([lambda t, u, p: (u.v, -p.lam * u.u)], [2], ["u", "v"], ["lam"])
print(batch.values(np.zeros(1), np.array([[2.0, 3.0]]), np.empty((0, 2)), np.array([5.0])).tolist())
"""


@pytest.mark.full
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
import numpy as np
from contin.lowlevel import Batch

def problem(helper):
    def rhs(t, u, p):
        return (helper(u.x),)
    return Batch([rhs], [1], ["x"], ["k"])

def one():
    def helper(x):
        return 10 * x
    return problem(helper)

def two():
    def helper(x):
        return x + 20
    return problem(helper)

for name in sys.argv[1:]:
    print(globals()[name]().values(np.zeros(1), np.array([[3.0]]), np.empty((0, 1)), np.ones(1))[0, 0])
"""


@pytest.mark.full
def test_functions_of_one_name_compiled_by_two_processes_stay_apart(folder, tmp_path):
    """Each compiled by a process of its own, both loaded by a third: f(3) is 30 and 23."""
    script = tmp_path / "same_names.py"
    script.write_text(SAME_NAMES)
    environment = {**os.environ, "CONTIN_CACHE_DIR": str(folder), "PYTHONPATH": os.pathsep.join(sys.path)}

    def run(*names):
        done = subprocess.run([sys.executable, script, *names], env=environment, capture_output=True, text=True, check=True)
        return [float(line) for line in done.stdout.split()]

    assert run("one") == pytest.approx([30])
    assert run("two") == pytest.approx([23])
    assert run("one", "two") == pytest.approx([30, 23])


@pytest.mark.posix("a folder that nobody can make")
def test_an_installation_and_a_home_that_cannot_be_used(tmp_path, monkeypatch, capsys):
    """Neither a cache nor a home: compiled code goes to one temporary folder, and a line says what to set."""
    monkeypatch.setattr(os, "access", lambda path, mode: str(path).startswith(str(tmp_path)))
    monkeypatch.setattr(cache, "_temporary_directory", cache.functools.cache(cache._temporary_directory.__wrapped__))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    for name, value in {"HOME": "/proc/none", "XDG_CACHE_HOME": "", "CONTIN_CACHE_DIR": ""}.items():
        monkeypatch.setenv(name, value)
    folder = cache.cache_directory()
    assert folder.parent == tmp_path and Kernel(_twice, reorder=True).compiled(X, 2) == 12.0 and _file(folder).exists()
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "set CONTIN_CACHE_DIR to keep it" in said
    monkeypatch.setattr(tempfile, "tempdir", "/proc/none")
    cache._temporary_directory.cache_clear()
    with pytest.raises(ContinError, match="no place for compiled code: .*; set CONTIN_CACHE_DIR"):
        cache.cache_directory()
