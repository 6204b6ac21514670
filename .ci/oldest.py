"""``python .ci/oldest.py > oldest.txt``: constraints that select the oldest version of every dependency and extra.

The versions are the lower bounds in pyproject.toml, so they stand in one place: ``pip install -c oldest.txt ".[test]"``.
"""

import re
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).resolve().parent.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
for requirement in sorted({*project["dependencies"], *sum(project["optional-dependencies"].values(), [])}):
    name, lowest = re.match(r"([\w-]+)(?:\[\w+\])?>=([\w.]+)", requirement).groups()
    print(f"{name}=={lowest}")
