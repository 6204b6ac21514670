"""Faults of runs of many branches."""

from __future__ import annotations

import contextlib
import json
import os
import random
import signal
import time
from pathlib import Path

from tortures.runs import Run, Scene, claim, columns


def content(folder: Path) -> dict[str, object]:
    """Return the columns of all branches, and the graph."""
    found: dict[str, object] = {path.name: columns(path) for path in sorted(folder.glob("*.h5"))}
    graph = json.loads((folder / "diagram.json").read_text())
    found["nodes"] = sorted(json.dumps(node, sort_keys=True) for node in graph["nodes"])
    found["edges"] = sorted(json.dumps(edge, sort_keys=True) for edge in graph["edges"])
    return found


def _children(pid: int) -> list[int]:
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def trial(scene: Scene, number: int | None, chance: random.Random) -> float:
    """Send a signal to a diagram (None: kill one of its workers), check it, and compute it to its end; return 0.0.

    Finished branches are not computed again.
    """
    out = scene.folder / "out"
    run = Run(scene.folder, *scene.words)
    time.sleep(scene.moment(chance))
    workers = _children(run.pid)
    if number is None:
        if workers:
            with contextlib.suppress(ProcessLookupError):
                os.kill(chance.choice(workers), signal.SIGKILL)
    else:
        run.send(number)
    code = run.wait()
    claim(code in ((0, 1) if number is None else (0, 130, -number)), f"exit code {code}: {run.said()}")
    if number is None and code == 1:
        failed = json.loads(json.loads((out / "diagram.json").read_text())["graph"]["failed"])
        claim(len(failed) >= 1, "exit code 1, and the graph names no failed branch")
    until = time.monotonic() + 5
    while any(map(_alive, workers)) and time.monotonic() < until:
        time.sleep(0.01)
    claim(not any(map(_alive, workers)), "workers outlive the run")
    before = {path: path.stat().st_mtime_ns for path in out.glob("*.h5")}
    for path in before:
        claim(columns(path) == scene.expected[path.name], f"{path.name} is not that of the undisturbed run")
    again = Run(scene.folder, *scene.words)
    claim(again.wait() == 0, f"cannot go on: {again.said()}")
    claim(content(out) == scene.expected, "another diagram in the end")
    claim(all(path.stat().st_mtime_ns == when for path, when in before.items()), "finished branches were computed again")
    return 0.0


FAULTS = {
    "kill -9": signal.SIGKILL, "SIGTERM": signal.SIGTERM, "Ctrl-C": signal.SIGINT, "kill -9 of a worker": None,
}  # fmt: skip
