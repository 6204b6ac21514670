"""Makes importable what tests of cycles and of connections compare with: tests/contin/cycles/noted.py."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
