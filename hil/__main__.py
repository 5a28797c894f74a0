"""``python -m hil``."""

import os
import sys
from pathlib import Path

if not sys.flags.safe_path and os.getcwd() != str(Path(__file__).resolve().parents[1]):
    # Python puts the working folder first, where a module of any name may lie next to somebody's recordings.
    sys.path[:] = [entry for entry in sys.path if entry not in ("", os.getcwd())]

from hil.cli.main import main

if __name__ == "__main__":
    main()
