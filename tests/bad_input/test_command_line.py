"""The command line itself: what is typed wrong is refused with the way to the help, which has an example."""

import pytest

from drivers.errors import BusDown, CommandRefused, ConfigMismatch, DeviceFault, DeviceTimeout, ProtocolViolation
from estimator.errors import BadModel, EstimatorError
from hil.cli.command_line import COMMANDS
from hil.cli.main import ExitStatus, exit_status, run
from hil.errors import RecordingError, RigFileError, RunAborted, UsageError
from tests.bad_input.conftest import Refused


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("diagnoze", "No such command 'diagnoze'. Did you mean 'diagnose'? See: hil --help"),
        ("--colour", "No such option: --colour. See: hil --help"),
        ("sim", "Missing argument 'RIG'. See: hil sim --help"),
        ("check --colour", "No such option: --colour"),
        ("run rig.toml", "Missing argument 'EXPERIMENT'. See: hil run --help"),
        ("identify", "Missing argument 'REC'. See: hil identify --help"),
        ("diagnose run.csv --out out", "Missing option '--model'. See: hil diagnose --help"),
        ("simulate", "Missing option '--model'. See: hil simulate --help"),
        ("compare", "Missing argument 'MODEL... REC...'. See: hil compare --help"),
        ("effects a b", "Got unexpected extra argument(s) (b). See: hil effects --help"),
        ("demo --seed many", "'--seed'"),
    ],
)
def test_wrong_use_is_refused_with_the_way_to_the_help(refused: Refused, line: str, said: str) -> None:
    assert said in refused(*line.split())


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (KeyboardInterrupt(), ExitStatus.INTERRUPTED),
        (CommandRefused("too much torque"), ExitStatus.REFUSED_BY_GUARD),
        (ConfigMismatch("another device"), ExitStatus.DEVICE_FAULT),
        (DeviceFault("EMCY"), ExitStatus.DEVICE_FAULT),
        (ProtocolViolation("a PDO of 3 bytes"), ExitStatus.DEVICE_FAULT),
        (DeviceTimeout("no answer"), ExitStatus.DEVICE_FAULT),
        (BusDown("no bus"), ExitStatus.DEVICE_FAULT),
        (RunAborted("clutch"), ExitStatus.DEVICE_FAULT),
        (RigFileError("rig.toml", "period_s | wrong"), ExitStatus.BAD_INPUT),
        (RecordingError("run.csv", "line 3"), ExitStatus.BAD_INPUT),
        (UsageError("--out"), ExitStatus.BAD_INPUT),
        (BadModel("effects.gremlins"), ExitStatus.BAD_INPUT),
        (EstimatorError("too short"), ExitStatus.BAD_INPUT),
        (OSError(28, "No space left on device"), ExitStatus.BAD_INPUT),
    ],
)
def test_every_family_has_its_exit_status(error: BaseException, status: ExitStatus) -> None:
    assert exit_status(error) is status


def test_a_defect_has_none_and_keeps_its_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    defect = ZeroDivisionError("a defect")
    assert exit_status(defect) is None
    monkeypatch.setitem(COMMANDS, "nothing_of_this_name", "not there")
    with pytest.raises(ModuleNotFoundError, match="nothing_of_this_name"):
        run(["nothing_of_this_name"])
