"""``python scripts/plot_diagram.py RESULT``: the command ``ribbon plot`` (`branches.plot`) from a working copy."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from branches.store import interrupt  # noqa: E402

if __name__ == "__main__":
    interrupt.begin("no picture was written")
    from branches.plot import main

    sys.exit(interrupt.run(main))
