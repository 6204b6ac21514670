"""``python -m branches.shell``: the unfolding strip as a solid by finite elements (`branches.paper.shell_run`)."""

from branches.store import interrupt

if __name__ == "__main__":  # before the imports below, which take a second
    interrupt.begin("finished cases are kept, and the same command computes the others")

import sys

from branches.paper.shell_run import main, parser

__all__ = ["main", "parser"]

if __name__ == "__main__":
    sys.exit(interrupt.run(main))
