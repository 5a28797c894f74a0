"""``python -m hil.proof.power``."""

import sys

from hil.proof.power.run import main

sys.exit(main())
