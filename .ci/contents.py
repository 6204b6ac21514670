"""``python .ci/contents.py DIST``: the wheels and the sdists in DIST hold all of their packages, and nothing else."""

import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

dist, root = Path(sys.argv[1]), Path(__file__).resolve().parent.parent
DISTRIBUTIONS = {"contin": ["contin"], "ribbon_continuation": ["contin", "ribbon_model", "branches"]}
ABOUT = re.compile(r"(LICENSE|MANIFEST\.in|PKG-INFO|README\.md|pyproject\.toml|setup\.cfg|configs/.+\.yaml|.+\.egg-info/.+)")


def tracked(*folders: str) -> set[str]:
    """Return the files of the project in some folders."""
    return set(subprocess.run(["git", "ls-files", *folders], cwd=root, capture_output=True, text=True).stdout.split())


def check(name: str, folders: list[str]) -> bool:
    """Print what is missing in a distribution, and what should not be there; return whether there is any."""
    packages = tracked(*folders)
    scenes = {f"branches/{file}" for file in tracked("configs")} if "branches" in folders else set()
    (wheel,), (sdist,) = dist.glob(f"{name}-*.whl"), dist.glob(f"{name}-*.tar.gz")
    in_wheel = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    with tarfile.open(sdist) as archive:
        in_sdist = {member.name.partition("/")[2] for member in archive if member.isfile()}
    problems = {
        "not in the wheel": (packages | scenes) - in_wheel,
        "in the wheel, and should not be": in_wheel - packages - scenes,
        "not in the sdist": packages - in_sdist,
        "in the sdist, and should not be": {name for name in in_sdist - packages if not ABOUT.fullmatch(name)},
    }
    for what, names in problems.items():
        if names:
            print(f"{what}: {', '.join(sorted(names))}")
    print(f"{wheel.name}: {len(in_wheel)} files, {wheel.stat().st_size // 1024} kB; {sdist.name}: {len(in_sdist)} files")
    return any(problems.values())


wrong = [check(name, folders) for name, folders in DISTRIBUTIONS.items()]
sys.exit(any(wrong))
