"""Start-up: times of imports, of the first run of a scene with empty caches, of later runs, and the modules loaded."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.measure import SCRIPTS, environment, in_turn, median

PACKAGES = ("numpy", "scipy.integrate", "numba", "contin", "ribbon_model.domains", "branches.run.runner")
#: `import contin` alone loads nothing: names are loaded when they are first used.
STATEMENTS = {"contin": "from contin import BoundaryValueProblem, solve, trace"}
CONFIG = SCRIPTS.parent / "configs" / "m1_n2.yaml"
MODULES = """\
import sys
from branches.run.__main__ import main
code = main(sys.argv[1:])
names = sorted({name.partition(".")[0] for name in sys.modules if not name.startswith("_")} - set(sys.stdlib_module_names))
print("MODULES", len(sys.modules), *names)
sys.exit(code)
"""


def run(quick: bool) -> dict:
    """Return all start-up times, in seconds."""
    repeats = 3 if quick else 7
    statements = {name: STATEMENTS.get(name, f"import {name}") for name in ("sys", *PACKAGES)}
    imports = in_turn({name: lambda name=name: _timed(statements[name]) for name in statements}, repeats)
    empty = median(row["seconds"] for row in imports.pop("sys"))
    with tempfile.TemporaryDirectory(prefix="bench-start-") as name:
        folder = Path(name)
        caches = {"CONTIN_CACHE_DIR": str(folder / "contin")}
        first, *warm = (_scene(folder / f"{i}.h5", caches) for i in range(repeats + 1))
    return {
        "python": empty,
        "imports": {name: median(row["seconds"] for row in rows) - empty for name, rows in imports.items()},
        "dearest": _importtime("branches.run.runner")[:15],
        "first_run": first["seconds"], "warm_run": median(row["seconds"] for row in warm),
        "modules": [name for name in warm[-1]["modules"] if not name.startswith("contin_")], "module_count": warm[-1]["count"],
    }  # fmt: skip


def _timed(statement: str) -> dict:
    """Return the time of a Python process with these arguments."""
    began = time.perf_counter()
    subprocess.run([sys.executable, "-c", statement], env=environment(), check=True, capture_output=True)
    return {"seconds": time.perf_counter() - began}


def _scene(out: Path, caches: dict[str, str]) -> dict:
    """Run the scene m1_n2 as a process; return the time and the modules loaded."""
    began = time.perf_counter()
    command = [sys.executable, "-c", MODULES, str(CONFIG), "--quiet", "--out", str(out)]
    done = subprocess.run(command, env=environment(**caches), capture_output=True, text=True)
    elapsed = time.perf_counter() - began
    if done.returncode:
        raise RuntimeError(f"the scene {CONFIG} failed:\n{done.stdout[-1000:]}{done.stderr[-3000:]}")
    count, *names = re.search(r"^MODULES (.*)$", done.stdout, re.MULTILINE).group(1).split()
    return {"seconds": elapsed, "count": int(count), "modules": names}


def _importtime(module: str) -> list[tuple[str, float]]:
    """Return packages with the import time of their own modules in seconds, the slowest first."""
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-c", f"import {module}"],
        env=environment(),
        check=True,
        capture_output=True,
        text=True,
    )
    return by_package(done.stderr)


def by_package(text: str) -> list[tuple[str, float]]:
    """Return the self times of ``python -X importtime``, summed by top-level package, the slowest first."""
    spent: dict[str, float] = {}
    for own, name in re.findall(r"^import time:\s+(\d+) \|\s+\d+ \|\s+(\S+)", text, re.MULTILINE):
        package = name.partition(".")[0]
        spent[package] = spent.get(package, 0.0) + int(own) * 1e-6
    return sorted(spent.items(), key=lambda item: -item[1])


def table(results: dict) -> str:
    """Return the results as Markdown."""
    lines = ["| import | beyond an empty Python |", "|---|---|"]
    lines += [f"| `{name}` | {seconds:.2f} s |" for name, seconds in results["imports"].items()]
    lines += [
        "",
        f"An empty Python takes {results['python']:.2f} s; `python -m branches.run configs/m1_n2.yaml` "
        f"{results['first_run']:.1f} s the first time, with empty caches, and {results['warm_run']:.2f} s from then on. "
        f"It loads {results['module_count']} modules, beyond the standard library those of {', '.join(results['modules'])}.",
        "",
        "Own time by package when `branches.run.runner` is imported: "
        + ", ".join(f"{name} {1e3 * seconds:.0f} ms" for name, seconds in results["dearest"][:8])
        + ".",
    ]
    return "\n".join(lines)
