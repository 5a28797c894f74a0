"""``python -m hil.proof.real``."""

import sys

from hil.proof.real.run import main

sys.exit(main())
