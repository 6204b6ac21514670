"""Record every number of the scenes and of the bank of reference problems, and compare two records bit by bit.

    python scripts/compare.py record OUT.npz
    python scripts/compare.py A.npz B.npz

It shows that a change of the code changed no number: record before and after, on the same machine with the same versions, and
compare. A record is of the tree that this file lies in, wherever it is started from and whatever else is installed: every scene
of configs/ by the commands of `branches`, with its secondary branches, and every point of every case of the
bank of reference problems (bank/). All code is compiled afresh for it, and computes on one thread.

Exit code: 0 recorded, or identical; 1 something differs; 2 bad usage, a file that cannot be used, a scene that cannot be run.
(``--bank OUT.npz``, by which ``record`` runs the bank in a process of its own, takes compiled code from the usual caches.)
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import yaml
from benchmarks.measure import ONE_THREAD

ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("contin", "ribbon_model", "branches")
#: Attributes of result files that are left out: the versions and the machine of a result.
EXCLUDED_ATTRIBUTES = ("versions", "platform")
#: Pattern that is replaced in printed lines: the time of a run.
CLOCK = re.compile(r"\bin \d+\.\d+ s$", re.MULTILINE)
#: Fields of a point's discretization that are recorded.
OF_SYSTEM = ("mesh", "degree")
#: Number of processes, and largest number of lines that a comparison prints.
PROCESSES, MOST_LINES = 2, 40
USAGE = "usage: compare.py record OUT.npz, or compare.py A.npz B.npz"

Record = dict[str, np.ndarray]


class CompareError(Exception):
    """A value that cannot be recorded or compared; the message is one sentence."""


# --- values as arrays -------------------------------------------------------------------------------------------------


def plain(key: str, value: Any) -> np.ndarray:
    """Return one value as an array without Python objects; texts as unicode."""
    array = np.asarray(value)
    if array.dtype.kind == "O" and all(isinstance(item, str) for item in array.flat):
        array = array.astype(str)
    if array.dtype.hasobject:
        raise CompareError(f"{key}: a {type(value).__name__} cannot be recorded")
    return array.view(np.lib.format.drop_metadata(array.dtype))  # of h5py's, which no .npy file keeps


def is_number(value: Any) -> bool:
    """Return whether a value is a single number."""
    return isinstance(value, (bool, int, float, complex, np.number, np.bool_))


def flat(key: str, value: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the parts of a value as (key, array): a mapping of numbers as one row with named columns, all others by parts."""
    if value is None:
        yield key, np.asarray("none")
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from flat(f"{key}/{field.name}", getattr(value, field.name))
    elif isinstance(value, Mapping) and value and all(map(is_number, value.values())):
        columns = [(str(name), np.asarray(number).dtype) for name, number in value.items()]
        yield key, plain(key, np.array(tuple(value.values()), dtype=columns))
    elif isinstance(value, Mapping):
        yield f"{key}/length", np.asarray(len(value))
        for name, item in value.items():
            yield from flat(f"{key}/{name}", item)
    elif isinstance(value, (list, tuple)) and not (len({type(item) for item in value}) == 1 and is_number(value[0])):
        yield f"{key}/length", np.asarray(len(value))
        for number, item in enumerate(value):
            yield from flat(f"{key}/{number}", item)
    else:
        yield key, plain(key, value)


# --- result files -----------------------------------------------------------------------------------------------------


def of_hdf5(key: str, path: Path) -> Record:
    """Yield every dataset, and every attribute (after an @) that is not excluded."""
    found: Record = {}

    def take(name: str, item: h5py.Group | h5py.Dataset) -> None:
        here = f"{key}/{name}".rstrip("/")
        if isinstance(item, h5py.Dataset):
            found[here] = plain(here, item[()])
        for attribute, value in item.attrs.items():
            if attribute not in EXCLUDED_ATTRIBUTES:
                found[f"{here}@{attribute}"] = plain(f"{here}@{attribute}", value)

    with h5py.File(path) as file:
        take("", file)
        file.visititems(take)
    return found


def of_file(key: str, path: Path) -> Record:
    """Yield the content of a result file: HDF5 and JSON by parts, other files as text."""
    if path.suffix == ".h5":
        return of_hdf5(key, path)
    text = path.read_text(encoding="utf-8")
    return dict(flat(key, json.loads(text) if path.suffix == ".json" else text))


# --- scenes -----------------------------------------------------------------------------------------------------------


def environment(folder: Path) -> dict[str, str]:
    """Return the environment of processes: this tree before any installed one, one thread, compiled code kept in ``folder``."""
    paths = filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")])
    caches = {"CONTIN_CACHE_DIR": str(folder / "contin")}
    changes = {"PYTHONPATH": os.pathsep.join(paths), "PYTHONIOENCODING": "utf-8", "COLUMNS": "80"}
    return os.environ | ONE_THREAD | caches | changes


def run(words: list[str], env: dict[str, str]) -> subprocess.CompletedProcess:
    """Run Python in the root of the tree.

    Raises
    ------
    CompareError
        The run failed. Exit code 1, for a branch that was lost, is not a failure here.
    """
    done = subprocess.run([sys.executable, *words], cwd=ROOT, env=env, capture_output=True, encoding="utf-8")
    if done.returncode not in (0, 1) or "Traceback" in done.stderr:
        said = (done.stderr.strip().splitlines() or ["nothing said"])[-1]
        raise CompareError(f"python {' '.join(words)} failed with exit code {done.returncode}: {said}")
    return done


def command(key: str, words: list[str], folder: Path, env: dict[str, str]) -> Record:
    """Run a module; return its exit code and its output, without times and without the name of the folder."""
    done = run(["-m", *words], env)
    said = CLOCK.sub("in ... s", done.stdout).replace(str(folder), "OUT")
    return {f"{key}/{words[0]}/exit": np.asarray(done.returncode), f"{key}/{words[0]}/stdout": np.asarray(said)}


def strip_options(path: Path) -> list[str]:
    """Return the options of `branches.strip` for a scene's strip; none if it has no strip."""
    strip = yaml.safe_load(path.read_text(encoding="utf-8")).get("strip", {})
    return [word for name, value in strip.items() for word in (f"--{name.replace('_', '-')}", str(value))]


def has_secondaries(path: Path) -> bool:
    """Return whether secondary branches leave the branch of a result file."""
    with h5py.File(path) as file:
        return bool(np.any(file["events"]["label"] == b"SB"))


def scene(path: Path, folder: Path, env: dict[str, str]) -> Record:
    """Run a scene as a user does, then its strip in SI units and its secondary branches."""
    key = f"configs/{path.stem}"
    folder.mkdir()
    # one worker: the order of branches in a diagram must not depend on their times
    found = command(key, ["branches.run", str(path), "--out", str(folder), "--workers", "1"], folder, env)
    if options := strip_options(path):
        found |= command(key, ["branches.strip", *options], folder, env)
    results = sorted(folder.glob("*.h5"))
    if not results:
        raise CompareError(f"{path.name} gave no result file")
    if len(results) == 1 and has_secondaries(results[0]):
        found |= command(key, ["branches.secondary", str(results[0])], folder, env)
    for result in sorted(folder.rglob("[!.]*")):
        if result.is_file():
            found |= of_file(f"{key}/{result.relative_to(folder).as_posix()}", result)
    return found


# --- the bank ---------------------------------------------------------------------------------------------------------


def bank_modules() -> list[str]:
    """Return the modules of the bank that have cases."""
    files = sorted((ROOT / "bank").glob("*.py"))
    return [file.stem for file in files if re.search(r"^CASES\b", file.read_text(encoding="utf-8"), re.MULTILINE)]


def of_point(key: str, point: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Yield all fields of a point, and the recorded fields of its discretization."""
    for field in dataclasses.fields(point):
        value = getattr(point, field.name)
        if field.name == "system":
            value = {name: getattr(value, name) for name in OF_SYSTEM if hasattr(value, name)}
        yield from flat(f"{key}/{field.name}", value)


def of_bank() -> Record:
    """Run every case of the bank in this process; yield all points of its branch, and the reason of its end."""
    found: Record = {}
    for name in bank_modules():
        for case in importlib.import_module(f"bank.{name}").CASES:
            key, branch = f"bank/{case.name}", case.run()
            if f"{key}/points" in found:
                raise CompareError(f"the bank has two cases named {case.name!r}")
            found[f"{key}/points"] = np.asarray(len(branch.points))
            found |= flat(f"{key}/stop", branch.stop)
            for number, point in enumerate(branch.points):
                found |= of_point(f"{key}/{number}", point)
    return found


def bank(folder: Path, env: dict[str, str]) -> Record:
    """Return the bank's record, made in a process of its own."""
    path = folder / "bank.npz"
    run([str(Path(__file__).resolve()), "--bank", str(path)], env)
    return read(path)


# --- records ----------------------------------------------------------------------------------------------------------


def write(path: Path, record: Record) -> None:
    """Write a record as a whole."""
    part = path.with_name(f".{path.name}.part")
    try:
        with open(part, "wb") as file:
            np.savez_compressed(file, **record)
        os.replace(part, path)
    except OSError as error:
        raise CompareError(f"cannot write {str(path)!r}: {error.strerror}") from error
    finally:
        part.unlink(missing_ok=True)


def read(path: Path) -> Record:
    """Return the arrays of a record."""
    try:
        with np.load(path, allow_pickle=False) as file:
            found = {name: file[name] for name in file.files}
    except OSError as error:
        raise CompareError(f"cannot read {str(path)!r}: {error.strerror or error}") from error
    except (ValueError, EOFError, AttributeError, TypeError, zipfile.BadZipFile, zlib.error) as error:
        raise CompareError(f"cannot read {str(path)!r}: it is no record, or damaged") from error
    if not found:
        raise CompareError(f"{str(path)!r} holds no array")
    return found


def check_tree(env: dict[str, str]) -> None:
    """Raise CompareError unless processes import the packages of this tree."""
    code = f"import {', '.join(PACKAGES)}; print({', '.join(f'{name}.__file__' for name in PACKAGES)}, sep=chr(10))"
    for file in run(["-c", code], env).stdout.splitlines():
        if ROOT not in Path(file).resolve().parents:
            raise CompareError(f"{file} is imported, which is not below {ROOT}")


def timed(name: str, job: Any, *arguments: Any) -> Record:
    """Do one job, and print its time."""
    began = time.monotonic()
    found = job(*arguments)
    print(f"{name}: {len(found)} arrays, {time.monotonic() - began:.0f} s", flush=True)
    return found


def record(path: Path) -> None:
    """Record all scenes and the bank."""
    configs = sorted((ROOT / "configs").glob("*.yaml"), key=lambda file: (not is_long(file), file.name))
    with tempfile.TemporaryDirectory(prefix="compare-") as name, ThreadPoolExecutor(PROCESSES) as pool:
        folder = Path(name).resolve()
        env = environment(folder)
        check_tree(env)
        jobs = [pool.submit(timed, "bank", bank, folder, env)]
        jobs += [pool.submit(timed, file.name, scene, file, folder / file.stem, env) for file in configs]
        try:
            found = functools.reduce(lambda all_, job: all_ | job.result(), jobs, {})
        finally:
            pool.shutdown(cancel_futures=True)
    write(path, found)
    print(f"{path}: {count(found.values())}")


def is_long(path: Path) -> bool:
    """Return whether a scene takes much longer than others, and should not come last: those of many branches."""
    values = yaml.safe_load(path.read_text(encoding="utf-8"))
    return any(isinstance(value, list) for value in values.values())


# --- comparison -------------------------------------------------------------------------------------------------------


def columns(array: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Return the named columns of an array; itself, without a name, where it has none."""
    names = array.dtype.names
    return [("", array)] if names is None else [(name, array[name]) for name in names]


def count(arrays: Iterable[np.ndarray]) -> str:
    """Return the number of arrays, and of the numbers in them."""
    arrays = list(arrays)
    numbers = sum(column.size for array in arrays for _, column in columns(array) if column.dtype.kind in "biufc")
    return f"{len(arrays)} arrays, {numbers} numbers"


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Return whether two arrays agree in type, shape and every bit."""
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def gaps(a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    """Return the largest absolute and relative difference of two arrays of numbers; inf where one alone is not a number."""
    wide = complex if "c" in (a.dtype.kind, b.dtype.kind) else float
    a, b = np.atleast_1d(a.astype(wide)), np.atleast_1d(b.astype(wide))
    with np.errstate(all="ignore"):
        absolute = np.abs(a - b)
        relative = absolute / np.maximum(np.abs(a), np.abs(b))
    absolute[np.isnan(a) != np.isnan(b)] = np.inf
    relative[np.isinf(absolute)] = np.inf
    return tuple(float(np.nanmax(gap, initial=0.0)) for gap in (absolute, relative))


def changed_line(a: np.ndarray, b: np.ndarray) -> str:
    """Return the first line in which two arrays of texts differ."""
    lines = [[line for text in array.astype(str).ravel().tolist() for line in text.split("\n")] for array in (a, b)]
    longest = max(map(len, lines))
    pairs = zip(*(part + [""] * (longest - len(part)) for part in lines))
    here, there = next((pair for pair in pairs if pair[0] != pair[1]), ("", ""))
    at = max(0, len(os.path.commonprefix([here, there])) - 30)
    return f"{here[at : at + 70]!r} and {there[at : at + 70]!r}"


def difference(a: np.ndarray, b: np.ndarray) -> str:
    """Return the difference of two arrays in words."""
    shapes = f"shape {a.shape}" if a.shape == b.shape else f"shapes {a.shape} and {b.shape}"
    if a.dtype.kind in "US" and b.dtype.kind in "US":
        return f"text, {shapes}: {changed_line(a, b)}"
    if a.dtype != b.dtype:
        return f"{shapes}, types {a.dtype} and {b.dtype}"
    if a.shape != b.shape:
        return shapes
    parts = []
    for (name, left), (_, right) in zip(columns(a), columns(b)):
        if left.tobytes() == right.tobytes():
            continue
        label = f"{name}: " if name else ""
        if left.dtype.kind in "biufc":
            absolute, relative = gaps(left, right)
            by = f"by {absolute:.1e}, relative {relative:.1e}" if absolute else "in the sign of a zero or the bits of a NaN"
            parts.append((relative, f"{label}differs {by}"))
        else:
            parts.append((-1.0, f"{label}{changed_line(left, right)}"))
    others = f" ({len(parts) - 1} more columns differ)" if len(parts) > 1 else ""
    return f"{shapes}: {max(parts)[1]}{others}"


def compare(first: Path, second: Path) -> int:
    """Compare two records, and print the differences; return the exit code."""
    a, b = read(first), read(second)
    lines = [f"{key}: {difference(a[key], b[key])}" for key in a if key in b and not same(a[key], b[key])]
    changed = len(lines)
    lines += [f"{key}: only in {first}" for key in a if key not in b]
    lines += [f"{key}: only in {second}" for key in b if key not in a]
    if not lines:
        print(f"{count(a.values())}: identical")
        return 0
    print("\n".join(lines[:MOST_LINES]))
    if len(lines) > MOST_LINES:
        print(f"... and {len(lines) - MOST_LINES} more")
    alone = f"only in {first}: {len(a.keys() - b.keys())}, only in {second}: {len(b.keys() - a.keys())}"
    print(f"{count(a.values())}; arrays that differ: {changed}, {alone}")
    return 1


# --- the command ------------------------------------------------------------------------------------------------------


def output(text: str) -> Path:
    """Return the file of a record; raise CompareError if it cannot be written."""
    path = Path(text).resolve()
    if path.suffix != ".npz" or path.is_dir() or not path.parent.is_dir():
        raise CompareError(f"{text!r} must be the name of an .npz file in a folder that exists")
    return path


def bank_alone(path: Path) -> None:
    """Record the bank in this process, which must see this tree's packages and none installed elsewhere."""
    sys.path.insert(0, str(ROOT))
    contin = importlib.import_module("contin")
    if ROOT not in Path(contin.__file__).resolve().parents:
        raise CompareError(f"{contin.__file__} is imported, which is not below {ROOT}")
    write(path, of_bank())


def main(argv: list[str] | None = None) -> int:
    """Run the command; return the exit code."""
    words = sys.argv[1:] if argv is None else argv
    if words in (["-h"], ["--help"]):
        print(__doc__.strip())
        return 0
    try:
        if len(words) != 2:
            raise CompareError(USAGE)
        if words[0] == "record":
            record(output(words[1]))
            return 0
        if words[0] == "--bank":
            bank_alone(output(words[1]))
            return 0
        return compare(Path(words[0]), Path(words[1]))
    except CompareError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
