"""``python .ci/contents.py DIST``: the wheel and the sdist in DIST hold all of the three packages, and nothing else."""

import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

dist, root = Path(sys.argv[1]), Path(__file__).resolve().parent.parent
listed = subprocess.run(["git", "ls-files", "contin", "ribbon_model", "branches"], cwd=root, capture_output=True, text=True)
packages = set(listed.stdout.split())
(wheel,), (sdist,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
in_wheel = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
with tarfile.open(sdist) as archive:
    in_sdist = {member.name.partition("/")[2] for member in archive if member.isfile()}
about = re.compile(r"(LICENSE|MANIFEST\.in|PKG-INFO|README\.md|pyproject\.toml|setup\.cfg|configs/.+\.yaml|.+\.egg-info/.+)")
problems = {
    "not in the wheel": packages - in_wheel,
    "in the wheel, and should not be": in_wheel - packages,
    "not in the sdist": packages - in_sdist,
    "in the sdist, and should not be": {name for name in in_sdist - packages if not about.fullmatch(name)},
}
for what, names in problems.items():
    if names:
        print(f"{what}: {', '.join(sorted(names))}")
print(f"{wheel.name}: {len(in_wheel)} files, {wheel.stat().st_size // 1024} kB; {sdist.name}: {len(in_sdist)} files")
sys.exit(any(problems.values()))
