"""Everything that is fuzzed, by name."""

from tests.campaigns.fuzz.bus import BUSES
from tests.campaigns.fuzz.files import FILES
from tests.campaigns.fuzz.target import Target

TARGETS: dict[str, Target] = {**FILES, **BUSES}
