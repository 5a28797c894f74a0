"""``python -m hil.proof.campaign``."""

import sys

from hil.proof.campaign.run import main

sys.exit(main())
