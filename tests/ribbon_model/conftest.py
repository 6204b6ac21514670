"""Makes what tests compare with importable: conjugate_points.py, half_loop_energy.py and mode_matrix.py of this folder."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
