"""Compare contin with AUTO-07p on AUTO's demos, label by label, and write docs/auto.md.

    python scripts/demos.py [NAME ...] [--auto-demos DIR] [--page FILE] [--repeats N]

AUTO's values and times are measured where ``--auto-demos`` names the folder ``demos`` of AUTO's distribution, and are then
recorded in scripts/side_by_side/auto_07p.json; without it the recorded values and times are used. Each demo runs in a process
of its own. ``--page`` puts the tables between the two markers of that file.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parent
sys.path[:0] = [str(SCRIPTS), str(SCRIPTS.parent)]
#: AUTO's recorded runs of all demos.
RECORDED = SCRIPTS / "side_by_side" / "auto_07p.json"
#: Most seconds of one demo in contin.
LONGEST = 900


def alone(name: str, repeats: int, as_auto: bool) -> None:
    """Run contin's side of one demo in this process, and print its points and times as JSON."""
    from side_by_side import ours

    if as_auto:
        ours.take_autos_tolerances()
    else:
        ours.take_path_tolerance()
    print(json.dumps(ours.run(name, repeats, checked=not as_auto)))


def contin_of(name: str, repeats: int, as_auto: bool = False) -> dict:
    """Run contin's side of a demo in a process of its own, on request with AUTO's tolerances."""
    command = [sys.executable, str(Path(__file__).resolve()), "--alone", name, "--repeats", str(repeats)]
    command += ["--as-auto"] if as_auto else []
    done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, env=os.environ.copy())
    if done.returncode:
        return {"failed": done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "no message"}
    return json.loads(done.stdout.splitlines()[-1])


def auto_of(folder: Path, demo, repeats: int) -> dict:
    """Run AUTO's side of a demo: its own runs, repeated for their times, and a finer one."""
    from side_by_side import auto_07p

    found = [auto_07p.run(folder, demo.name, demo.file) for _ in range(1 if demo.slow else max(1, repeats))]
    runs = found[0]
    fine = auto_07p.run_finer(folder, demo.name, demo.file, runs)
    for number, each in enumerate(runs):
        seconds = sorted(other[number]["seconds"] for other in found if number < len(other))
        each["seconds"] = seconds[len(seconds) // 2]
    return {"runs": [short(each) for each in runs], "fine": [short(each) for each in fine]}


def short(run: dict) -> dict:
    """Return a run of AUTO without the points that are printed at regular distances."""
    points = [
        {"label": point["label"], "values": {key: value for key, value in point["values"].items() if key}}
        for point in run["points"] if point["label"] not in ("RG", "")
    ]  # fmt: skip
    return {"constants": run["constants"], "seconds": run["seconds"], "points": points}


def arguments(argv=None) -> argparse.Namespace:
    """Return the parsed command line."""
    parser = argparse.ArgumentParser(prog="python scripts/demos.py", description=__doc__.splitlines()[0], allow_abbrev=False)
    parser.add_argument("names", nargs="*", metavar="NAME", help="demos (default: all)")
    parser.add_argument("--auto-demos", metavar="DIR", help="the folder demos of AUTO-07p's distribution: run AUTO, too")
    parser.add_argument("--only-auto", action="store_true", help="run AUTO, and nothing else")
    parser.add_argument("--page", metavar="FILE", help="put the tables into this Markdown file")
    parser.add_argument("--repeats", type=int, default=3, metavar="N", help="runs for the median time (default: 3)")
    parser.add_argument(
        "--kept", metavar="FILE", default="demos.json", help="contin's results are kept here (default: demos.json)"
    )
    parser.add_argument("--alone", metavar="NAME", help=argparse.SUPPRESS)
    parser.add_argument("--as-auto", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(argv)
    if options.auto_demos and not (Path(options.auto_demos) / "ab").is_dir():
        parser.error(f"--auto-demos {options.auto_demos!r}: must be a folder that holds AUTO's demos, ab among them")
    if options.repeats < 0:
        parser.error(f"--repeats {options.repeats}: must be 0 (time the first run) or more")
    return options


def main(argv=None) -> int:
    """Run the command; return the exit code."""
    options = arguments(argv)
    if options.alone:
        alone(options.alone, options.repeats, options.as_auto)
        return 0
    from side_by_side import page
    from side_by_side.all_demos import DEMOS

    recorded = json.loads(RECORDED.read_text()) if RECORDED.exists() else {}
    kept_file = Path(options.kept)
    kept = json.loads(kept_file.read_text()) if kept_file.exists() else {}
    unknown = set(options.names) - {demo.name for demo in DEMOS}
    if unknown:
        print(f"error: {sorted(unknown)}: no demos of AUTO-07p with these names", file=sys.stderr)
        return 2
    for demo in DEMOS:
        if not demo.parts or (options.names and demo.name not in options.names):
            continue
        if options.auto_demos:
            recorded[demo.name] = auto_of(Path(options.auto_demos), demo, options.repeats)
            lines = [f"{json.dumps(name)}: {json.dumps(recorded[name], sort_keys=True)}" for name in sorted(recorded)]
            RECORDED.write_text("{\n" + ",\n".join(lines) + "\n}\n")
        if options.only_auto:
            continue
        repeats = 0 if demo.slow else options.repeats
        kept[demo.name] = {**contin_of(demo.name, repeats), "as_auto": contin_of(demo.name, repeats, as_auto=True)}
        kept_file.write_text(json.dumps(kept) + "\n")
        print(page.line(demo, recorded.get(demo.name), kept[demo.name]), flush=True)
    if options.page:
        page.write(Path(options.page), DEMOS, recorded, kept)
    return 0


if __name__ == "__main__":
    sys.exit(main())
