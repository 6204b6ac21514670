"""Makes what tests compare with importable: tests/ribbon_model/conjugate_points.py."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
