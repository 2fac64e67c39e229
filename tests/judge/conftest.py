"""Makes the judge importable from the root of the repository, as the command that runs thousands of draws has it."""

import sys
from pathlib import Path

ROOT = str(Path(__file__).parents[2])
if ROOT not in sys.path:
    sys.path.insert(0, ROOT)
