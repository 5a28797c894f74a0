"""``python -m tests.kernels``: compile what most tests need, once, while lint is at work.

In a fresh clone two workers would compile the same kernels at the same time.
"""

from contextlib import suppress

from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.first_use import compile_kernels
from estimator.errors import EstimatorError
from estimator.identification.settings import Settings
from hil.rig.live import Pace, play_record, tracking_settings
from hil.simulator.driveline import DrivelinePlant
from tests.benchmarks.cases import make
from tests.estimator.physics import test_own_law as own_law
from tests.estimator.physics.bench import TWO_MASS

SHORT_S = 4.0


def main() -> None:
    """Run the truth, the diagnosis and both on-line chains over a few seconds."""
    for masses in (2, 3, 1):
        compile_kernels(masses)
    case = make("backlash", 1, SHORT_S)
    with suppress(EstimatorError):  # so short they need not tell anything: all there is to compile has been by then
        diagnose(case.records, case.model)
    own_law.simulated({"mine": {"size": 0.01}}, TWO_MASS, own_law.law(own_law.square))
    DrivelinePlant(case.model, case.records[0].sample_time_s)  # the kernel that a simulated rig is stepped with
    for settings in (Settings(), tracking_settings()):
        play_record(case.records[0], settings, Pace(), lambda course, now_s: None, None)


if __name__ == "__main__":
    main()
