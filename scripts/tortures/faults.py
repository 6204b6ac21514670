"""Faults of runs of one branch. Each function starts a run, injects its fault, waits for the end, and returns the run."""

from __future__ import annotations

import dataclasses
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable

from tortures.runs import TABLES, Fault, Run, Scene, claim, columns

#: Start a run, inject a fault at a random moment, wait for the end.
Happening = Callable[[Scene, random.Random], Run]


def _signalled(number: int, fresh: bool = False, twice: bool = False) -> Happening:
    """Send a signal at a random moment."""

    def fault(scene: Scene, chance: random.Random) -> Run:
        run = scene.start(fresh=fresh)
        for _ in range(1 + twice):
            time.sleep(scene.moment(chance) + (chance.uniform(0, 1.5) if fresh else 0))
            run.send(number)
        code = run.wait()
        claim(code in (0, 130, -number), f"exit code {code} after signal {number}: {run.said()}")
        return run

    return fault


def _killed_while_writing(scene: Scene, chance: random.Random) -> Run:
    """Kill (-9) between two lines of the code that writes."""
    last, written = chance.randrange(1, scene.lines + 1), writers()

    def prepare():
        count = 0

        def line(frame, event, argument):
            nonlocal count
            if event == "line":
                count += 1
                if count == last:
                    os.kill(os.getpid(), signal.SIGKILL)
            return line

        sys.settrace(lambda frame, event, argument: line if frame.f_code.co_filename in written else None)

    run = scene.start(prepare=prepare)
    code = run.wait()
    claim(code in (0, -signal.SIGKILL), f"exit code {code}: {run.said()}")
    return run


def writers() -> tuple[str, ...]:
    from branches.store import files
    from branches.store import writer as store
    from contin.lowlevel import write_whole

    return files.__file__, store.__file__, write_whole.__code__.co_filename


def _no_room(scene: Scene, chance: random.Random) -> Run:
    """Limit the size of files to a random value, as on a full disk."""
    size = chance.randrange(1, 2 * sum(map(len, scene.expected.values())))

    def prepare():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return _starved(scene, prepare)


def _starved(scene: Scene, prepare: Callable[[], None] | None) -> Run:
    """Check a run that cannot write everything: it is rejected, and the old file is unchanged."""
    before = scene.path.read_bytes() if scene.path.exists() else None
    run = scene.start(prepare=prepare)
    code = run.wait()
    claim(code in (0, 2), f"exit code {code}: {run.said()}")
    if code == 2 and before is not None and run.progress[0] == 0:
        claim(scene.path.read_bytes() == before, "a file that could not be replaced was changed")
    left = [path.name for path in scene.folder.glob(".*.part")]
    claim(not left, f"left behind: {left}")
    return run


def _full_disk(scene: Scene, chance: random.Random) -> Run:
    """Run on a small disk with little space; if none can be mounted, limit the size of files."""
    kept, disk = scene.path.read_bytes() if scene.path.exists() else b"", scene.folder.parent / f"{scene.folder.name}.disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", disk], capture_output=True).returncode:
        disk.rmdir()
        return _no_room(scene, chance)
    try:
        inside = dataclasses.replace(scene, folder=disk)
        if kept:
            inside.path.write_bytes(kept)
        shutil.copy(scene.folder / "scene.yaml", disk)
        (disk / "ballast").write_bytes(bytes(2**22 - chance.randrange(20_000, 600_000) - len(kept)))
        run = _starved(inside, None)
        if inside.path.exists():
            shutil.copy(inside.path, scene.path)
    finally:
        subprocess.run(["umount", disk], capture_output=True)
        disk.rmdir()
    return run


def _read_only(scene: Scene, chance: random.Random) -> Run:
    """Make the folder read-only at some moment, as a user without rights."""
    user = 65534 if os.getuid() == 0 else os.getuid()
    if os.getuid() == 0:
        for path in (scene.folder, *scene.folder.iterdir()):
            os.chown(path, user, -1)
    run = scene.start(prepare=lambda: os.setuid(user))
    time.sleep(chance.choice([0, scene.moment(chance)]))
    scene.folder.chmod(0o555)
    try:
        code = run.wait()
    finally:
        scene.folder.chmod(0o755)
    claim(code in (0, 2), f"exit code {code}: {run.said()}")
    return run


def _two_at_once(scene: Scene, chance: random.Random) -> Run:
    """Start a second run on the same file at a random moment: it is rejected, and the first one is not affected."""
    run = scene.start()
    time.sleep(scene.moment(chance))
    twin = dataclasses.replace(scene).start() if scene.path.exists() else Run(scene.folder, *scene.words)
    codes = run.wait(), twin.wait()
    claim(set(codes) <= {0, 2} and 0 in codes, f"exit codes {codes}: {run.said()}{twin.said()}")
    return run


def _power_cut(scene: Scene, chance: random.Random) -> Run:
    """Kill (-9) and lose unsynchronized data: a file that is being written keeps a part of its bytes."""
    run = _signalled(signal.SIGKILL)(scene, chance) if chance.random() < 0.5 else _killed_while_writing(scene, chance)
    for path in scene.folder.glob(".*.part"):
        os.truncate(path, chance.randrange(path.stat().st_size + 1))
    return run


def _cut_file(scene: Scene, chance: random.Random) -> Run:
    """Truncate the result itself: it is rejected in a sentence."""
    run = _signalled(signal.SIGKILL)(scene, chance)
    if not scene.path.exists():
        return run
    os.truncate(scene.path, chance.randrange(scene.path.stat().st_size))
    code = scene.start().wait()
    claim(code in (0, 2), f"exit code {code} for a file that was cut")
    if code == 2:
        scene.path.unlink()
        run.progress[0] = 0
    return run


FAULTS = {
    "kill -9": _signalled(signal.SIGKILL),
    "kill -9 between two lines of the writer": _killed_while_writing,
    "kill -9, process started anew": _signalled(signal.SIGKILL, fresh=True),
    "SIGTERM": _signalled(signal.SIGTERM),
    "SIGTERM, process started anew": _signalled(signal.SIGTERM, fresh=True),
    "Ctrl-C": _signalled(signal.SIGINT),
    "Ctrl-C twice": _signalled(signal.SIGINT, twice=True),
    "Ctrl-C, process started anew": _signalled(signal.SIGINT, fresh=True),
    "power cut": _power_cut,
    "result truncated": _cut_file,
    "file size limit": _no_room,
    "full disk": _full_disk,
    "read-only folder": _read_only,
    "two runs on one file": _two_at_once,
}


def inspect(scene: Scene, run: Run) -> float:
    """Check the file after a fault; return the seconds of the run whose points are lost."""
    kept, saved, computed = run.progress
    if not scene.path.exists():
        claim(kept == 0, f"{kept:.0f} points were on disk, and the file is gone")
        return computed - run.began
    try:
        found = columns(scene.path)
    except (OSError, KeyError) as error:
        raise Fault(f"does not open: {error}") from error
    for name, data in found.items():
        claim(scene.expected[name].startswith(data), f"{name} is no beginning of that of the undisturbed run")
    import h5py

    with h5py.File(scene.path, "r") as file:
        rows = len(file["points"])
    claim(rows >= kept, f"{rows} points in the file, {kept:.0f} were on disk")
    return max(0.0, computed - saved)


def trial(scene: Scene, fault: Happening, chance: random.Random) -> float:
    """Inject a fault into a scene once or a few times, then resume to its end; return the longest loss in seconds."""
    lost = 0.0
    for _ in range(chance.choice([1, 1, 2, 3])):
        run = fault(scene, chance)
        lost = max(lost, inspect(scene, run))
    run = scene.start()
    claim(run.wait() == 0, f"cannot go on: {run.said()}")
    found = columns(scene.path)
    differing = [name for name in TABLES if found[name] != scene.expected[name]]
    claim(not differing, f"other columns in the end: {differing}")
    left = sorted(path.name for path in scene.folder.iterdir() if path.suffix != ".part")
    claim(left == ["scene.yaml", "x.h5"], f"left behind: {left}")
    return lost
