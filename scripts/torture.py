"""Inject faults into runs (kills, interrupts, full disks, second runs), and check that they resume with the same bits.

    python scripts/torture.py [--trials 300] [--scenes branch secondary diagram ...] [--seed 1] [--keep DIR]

A trial is one scene, computed in its own processes. One to three times a fault is injected at a random moment. After each fault
the file must open with plain h5py and hold every point of the last checkpoint, bit by bit those of an undisturbed run. Then
the run resumes, and its final columns must be, bit by bit, those of the undisturbed run. This needs POSIX (fork, signals).
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import dataclasses
import multiprocessing
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parent
sys.path[:0] = [str(SCRIPTS), str(SCRIPTS.parent)]

from tortures import diagrams, faults  # noqa: E402
from tortures.runs import Fault, Run, Scene, claim, columns  # noqa: E402

SECONDARY = "{m: 3, n: 1, domain: half loop, stability: true, limits: {kappa_n: [-60, 100]}, stride: 5, origin: %s}"
ORIGIN = "{kappa_n: -21.62681748, kappa_star: 2.78375737, mode: wavenumber 1 even}"
SCENES = {
    "branch": "{m: 1, n: 2, steps: {largest: 0.05}, zeros: {kappa_n: [3.0, 1.0]}, stride: 3}",
    "stability": "{m: 1, n: 2, stability: true, stride: 3}",
    "half loop": "{m: 3, n: 4, domain: half loop, steps: {largest: 0.1}, stride: 3}",
    "secondary": SECONDARY % ORIGIN,
    "diagram": "{m: [1, 3], n: [4, 5], steps: {largest: 0.5}, stride: 10}",
}
# --- all of them ----------------------------------------------------------------------------------------------------


def undisturbed(name: str, folder: Path) -> Scene:
    """Return the time and the result of a scene without faults."""
    folder.mkdir(parents=True)
    (folder / "scene.yaml").write_text(SCENES[name])
    if name == "diagram":
        words: tuple[str, ...] = ("scene.yaml", "--out", "out", "--workers", "2")
        began = time.monotonic()
        claim(Run(folder, *words).wait() == 0, "the undisturbed run failed")
        return Scene(name, folder, words, time.monotonic() - began, 0, diagrams.content(folder / "out"))
    words = ("scene.yaml", "--out", "x.h5")
    scene, count = Scene(name, folder, words, 0.0, 0, {}), multiprocessing.RawValue("q")

    writers = faults.writers()

    def counting():
        def line(frame, event, argument):
            count.value += event == "line"
            return line

        sys.settrace(lambda frame, event, argument: line if frame.f_code.co_filename in writers else None)

    claim(scene.start(prepare=counting).wait() == 0, "the undisturbed run failed")
    scene.path.unlink()
    began = time.monotonic()
    claim(scene.start().wait() == 0, "the undisturbed run failed")
    return dataclasses.replace(scene, seconds=time.monotonic() - began, lines=count.value, expected=columns(scene.path))


def load_kernels(names: list[str]) -> None:
    """Compile or load the functions of the scenes, once before processes are forked."""
    from branches.run.display import (
        StartingDisplay,  # runs without rights cannot load modules that are not there when they fork
    )
    from branches.run.runner import compute_scene
    from branches.scene.parse import parse

    for name in names:
        config = parse(SCENES[name], name)
        one = next(iter(config.scenes.values()))
        compute_scene(one, StartingDisplay(quiet=True))


def torture(names: list[str], count: int, seed: int, folder: Path, tell: Callable[[str], None] = print) -> list[str]:
    """Run trials with scenes and kinds of faults in turn; return a line for each failure."""
    chance, problems, tally = random.Random(seed), [], collections.Counter()
    load_kernels(names)
    scenes = [undisturbed(name, folder / f"undisturbed-{name.replace(' ', '-')}") for name in names]
    for scene in scenes:
        tell(f"{scene.name}: {scene.seconds:.2f} s undisturbed")
    lost: dict[str, float] = collections.defaultdict(float)
    for number in range(count):
        scene = scenes[number % len(scenes)]
        kind = diagrams if scene.name == "diagram" else faults
        what = list(kind.FAULTS)[(number // len(scenes)) % len(kind.FAULTS)]
        place = folder / f"trial{number}"
        place.mkdir()
        (place / "scene.yaml").write_text(SCENES[scene.name])
        here, at = dataclasses.replace(scene, folder=place), chance.randrange(2**32)
        tally[scene.name, what] += 1
        try:
            lost[scene.name] = max(lost[scene.name], kind.trial(here, kind.FAULTS[what], random.Random(at)))
        except Fault as problem:
            problems.append(f"trial {number} ({scene.name}, {what}, seed {at}): {problem}")
            tell(problems[-1])
        else:
            shutil.rmtree(place)
            for said in folder.glob(f"trial{number}.*"):
                said.unlink()
    width = max(len(what) for _, what in tally)
    for what in dict.fromkeys([*faults.FAULTS, *diagrams.FAULTS]):
        row = ", ".join(f"{name} {n}" for (name, kind), n in tally.items() if kind == what)
        tell(f"  {what:{width}s}  {row}")
    tell("longest piece of a run that a fault took, s: " + ", ".join(f"{name} {s:.2f}" for name, s in lost.items() if s))
    tell(f"{count} trials, {len(problems)} failed")
    return problems


def main(argv=None) -> int:
    """Run the trials; return 1 if any failed."""
    parser = argparse.ArgumentParser(prog="python scripts/torture.py", description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=300, metavar="N", help="number of trials (default: 300)")
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES), metavar="SCENE", help=", ".join(SCENES))
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="seed of the random moments (default: 1)")
    parser.add_argument("--keep", metavar="DIR", help="folder for the trials; failed ones are kept")
    options = parser.parse_args(argv)
    with contextlib.ExitStack() as stack:
        folder = Path(options.keep or stack.enter_context(tempfile.TemporaryDirectory()))
        folder.mkdir(parents=True, exist_ok=True)
        folder.chmod(0o755)
        problems = torture(options.scenes, options.trials, options.seed, folder.resolve())
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
