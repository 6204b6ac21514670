"""Run the jobs of the workflow files here, as far as this machine goes, one after the other; say what was not run, and why.

    python .ci/workflows.py [NAME ...] [--list] [--log DIR]

NAME is a part of a job's name. Each job has a fresh clone of what is committed, a virtual environment of its own with the
Python that it names, and an empty home; its commands are those of the file. Artifacts are passed from job to job through a
folder. It needs PyYAML, and the Pythons on PATH or those of pyenv. The exit code is 1 if a job fails.
"""

import argparse
import itertools
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / ".github" / "workflows"
#: GitHub's names of machines like this one; any Linux stands for Ubuntu.
HERE = {("linux", "x86_64"): r"ubuntu-(latest|[\d.]+)"}.get((sys.platform, platform.machine()), "none")


def jobs() -> Iterator[tuple[str, dict, dict]]:
    """Yield the name, the job and the values of its matrix, for all jobs of all files, each after those that it needs."""
    for file in sorted(FOLDER.glob("*.yml")):
        for key, job in yaml.safe_load(file.read_text(encoding="utf-8"))["jobs"].items():
            matrix = dict(job.get("strategy", {}).get("matrix", {}))
            included = matrix.pop("include", None)
            product = [dict(zip(matrix, each)) for each in itertools.product(*matrix.values())]
            for values in included or product:
                yield f"{file.stem}/{key}: {filled(job['name'], values)}", job, values


def filled(text: str, values: dict) -> str:
    """Return a text with the values of its expressions."""
    return re.sub(r"\$\{\{(.*?)\}\}", lambda found: str(value(found[1], values)), str(text))


def value(expression: str, values: dict) -> object:
    """Return the value of an expression: names of the matrix and texts, with ``||`` between them."""
    parts = (part.strip().removeprefix("matrix.") for part in expression.split("||"))
    found = (part.strip("'") if part.startswith("'") else values.get(part) for part in parts)
    return next(filter(None, found), "")


def python_of(job: dict, values: dict) -> str:
    """Return the version of Python that a job asks for."""
    for step in job["steps"]:
        if "setup-python" in step.get("uses", ""):
            return filled(step["with"]["python-version"], values)
    return f"{sys.version_info[0]}.{sys.version_info[1]}"


def interpreter(version: str) -> str | None:
    """Return the path of a Python of this version, None where there is none."""
    kept = sorted(Path.home().glob(f".pyenv/versions/{version}.*/bin/python{version}"))
    return shutil.which(f"python{version}") if not kept else str(kept[-1])


def not_here(job: dict, values: dict) -> str:
    """Return why a job cannot run here; empty where it can."""
    system, version = filled(job["runs-on"], values), python_of(job, values)
    if not re.fullmatch(HERE, system):
        return f"needs {system}"
    return "" if interpreter(version) else f"no Python {version}"


def run(job: dict, values: dict, artifacts: Path, log: Path) -> bool:
    """Run a job in a folder of its own; return whether all of its commands did."""
    with tempfile.TemporaryDirectory() as folder, log.open("w", encoding="utf-8") as out:
        copy, home, venv = (Path(folder, name) for name in ("copy", "home", "venv"))
        home.mkdir()
        base = {name: text for name, text in os.environ.items() if name in ("PATH", "LANG") or name.startswith("PIP_")}
        base |= {"HOME": str(home), "PATH": f"{venv / 'bin'}:{base['PATH']}", "GITHUB_PATH": os.devnull}

        def command(*words: str, **more: str) -> bool:
            where = copy if copy.exists() else Path(folder)
            return subprocess.run(words, cwd=where, env={**base, **more}, stdout=out, stderr=out).returncode == 0

        if not command("git", "clone", "-q", str(ROOT), str(copy)):
            return False
        if not command(str(interpreter(python_of(job, values))), "-m", "venv", str(venv)):
            return False
        given = {name: filled(text, values) for name, text in job.get("env", {}).items()}
        for step in job["steps"]:
            uses = step.get("uses", "")
            if "sparse-checkout" in step.get("with", {}):
                command("git", "sparse-checkout", "set", *step["with"]["sparse-checkout"].split())
            if "run" in step:
                print("$", filled(step["run"], values), file=out, flush=True)
                if not command("bash", "-e", "-o", "pipefail", "-c", filled(step["run"], values), **given):
                    return False
            elif "artifact" in uses:
                name, path = artifacts / filled(step["with"]["name"], values), copy / step["with"]["path"].partition("*")[0]
                source, target = (path, name) if "upload" in uses else (name, path)
                if not source.exists():
                    print(f"no {source.name}: the job that makes it was not run", file=out)
                    return False
                shutil.copytree(source, target, dirs_exist_ok=True)
    return True


def main() -> int:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("names", nargs="*", metavar="NAME", help="parts of names of jobs (default: all)")
    parser.add_argument("--list", action="store_true", help="only say which jobs would run")
    parser.add_argument("--log", type=Path, default=Path("workflows"), metavar="DIR", help="folder for what jobs print")
    options = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory() as artifacts:
        for number, (name, job, values) in enumerate(jobs()):
            if options.names and not any(part in name for part in options.names):
                continue
            reason = not_here(job, values)
            if reason or options.list:
                print(f"{name}: {f'not run here, {reason}' if reason else 'runs here'}")
                continue
            options.log.mkdir(exist_ok=True)
            began, log = time.monotonic(), options.log / f"{number}.txt"
            done = run(job, values, Path(artifacts), log)
            failed += not done
            print(f"{name}: {'passed' if done else f'failed, see {log}'}, {time.monotonic() - began:.0f} s", flush=True)
    return min(failed, 1)


if __name__ == "__main__":
    sys.exit(main())
