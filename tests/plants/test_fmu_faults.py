"""FMUs that crash, end their process, hang, fill the disk or lead elsewhere: each is named, and nothing is left."""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimator.physics.model import DrivelineModel, Parameter, Structure
from hil.errors import UsageError
from hil.export.fmu import package
from hil.export.fmu.driveline import driveline
from hil.plants.fmu_plant import FmuPlant
from hil.plants.fmu_process import STEP_S, UNPACKED_BYTES, unpack
from hil.plants.names import Names
from tests.chosen import campaign, one_in
from tests.estimator.physics.bench import TWO_MASS
from tests.processes import GONE_S, is_gone

pytest.importorskip("fmpy")

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="x" guid="1"><CoSimulation modelIdentifier="{name}"/>
<ModelVariables>
<ScalarVariable name="T_M1" valueReference="0" causality="input" variability="continuous"><Real start="0"/>
</ScalarVariable>
<ScalarVariable name="speed_measured" valueReference="1" causality="output" variability="continuous"><Real/>
</ScalarVariable>
</ModelVariables><ModelStructure><Outputs><Unknown index="2"/></Outputs></ModelStructure></fmiModelDescription>"""

HEADERS = ("fcntl", "signal", "stdio", "stdlib", "unistd")
LOADED = "".join(f"#include <{each}.h>\n" for each in HEADERS) + "__attribute__((constructor)) static void f(void) "


def fmu(folder: Path, does: str = "{}", name: str = "x") -> Path:
    """Make an FMU whose library does something as it is loaded."""
    path = folder / "x.fmu"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION.format(name=name))
        if shutil.which("cc"):
            (folder / "x.c").write_text(LOADED + does)
            subprocess.run(["cc", "-shared", "-fPIC", "-o", folder / "x.so", folder / "x.c"], check=True, timeout=60)
            archive.write(folder / "x.so", "binaries/linux64/x.so")
    return path


def simulate(path: Path) -> Any:
    return simulated(FmuPlant(path, [], trusted=True))


def simulated(plant: FmuPlant) -> Any:
    record: Any = SimpleNamespace(time_s=np.arange(5) * 0.1, sample_time_s=0.1, name="run")
    names = Names(torque=("T_M1",), load="", start=())
    return plant.simulated(record, names, np.zeros((5, 1)), {})


COUNTED = """static int begun;
fmi2Status fmi2EnterInitializationMode(Instance c) { if (begun++) return fmi2Error; """
"""A binary that is good for one simulation, as some are: what it counts is the binary's own, not the instance's."""


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_each_simulation_begins_with_the_binary_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before, own = "fmi2Status fmi2EnterInitializationMode(Instance c) { ", package.own
    assert before in own("fmi2.c")
    monkeypatch.setattr(package, "own", lambda name: own(name).replace(before, COUNTED))
    model = DrivelineModel(Structure.TWO_MASS, {name: Parameter(value, 0.2) for name, value in TWO_MASS.items()})
    package.write(driveline("drive", model, 0.1), "2.0", tmp_path / "drive.fmu")
    plant = FmuPlant(tmp_path / "drive.fmu", [], trusted=True)
    first, second = simulated(plant), simulated(plant)
    assert np.isfinite(first).all()
    np.testing.assert_array_equal(first, second)


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A temporary folder of its own, to see what is left in it."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    return tmp_path / "temporary"


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize(
    ("does", "said"),
    [
        ("{ raise(SIGSEGV); }", "one that crashes \\(SIGSEGV\\)"),
        campaign(("{ _exit(0); }", "ends its process \\(exit status 0\\)")),
        campaign(("{ abort(); }", "one that crashes \\(SIGABRT\\)")),
    ],
)
def test_an_fmu_that_ends_its_process_is_named(tmp_path: Path, home: Path, does: str, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        simulate(fmu(tmp_path, does))
    assert not list(home.iterdir())


@pytest.mark.skipif(shutil.which("cc") is None or not Path("/proc").is_dir(), reason="no C compiler, or no /proc")
@pytest.mark.parametrize("leaves", [False, True])
def test_a_process_that_an_fmu_has_started_keeps_nobody_waiting_and_ends_with_its_group(
    tmp_path: Path, home: Path, leaves: bool
) -> None:
    child = tmp_path / "child"
    does = f"""{{
        if (!fork()) {{ {"setsid();" if leaves else ""}
            char text[20]; int file = creat("{child}", 0600);
            write(file, text, sprintf(text, "%d ", getpid())); for (;;) pause(); }}
        while (access("{child}", F_OK)) ; usleep(100000); raise(SIGSEGV); }}"""
    began_s = time.monotonic()
    with pytest.raises(UsageError, match="one that crashes \\(SIGSEGV\\)"):
        simulate(fmu(tmp_path, does))
    process = int(child.read_text())
    try:
        assert time.monotonic() - began_s < STEP_S
        assert is_gone(process, 0.2 if leaves else GONE_S) != leaves
    finally:
        if leaves:
            os.kill(process, signal.SIGKILL)


@pytest.mark.parametrize("name", one_in(4, ["../../x", "/x", "..", ""]))
def test_a_library_outside_is_not_loaded(tmp_path: Path, name: str) -> None:
    with pytest.raises(UsageError, match="expected an FMU"):
        FmuPlant(fmu(tmp_path, name=name), [], trusted=True)


@pytest.mark.parametrize("name", ["../x", "/x", "a/../../x"])
def test_nothing_is_unpacked_elsewhere(tmp_path: Path, name: str) -> None:
    with zipfile.ZipFile(tmp_path / "x.fmu", "w") as archive:
        archive.writestr(name, "x")
    with pytest.raises(ValueError, match="leads out"):
        unpack(tmp_path / "x.fmu", tmp_path / "home")


def test_no_more_is_unpacked_than_an_fmu_may_take(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hil.plants.fmu_process.UNPACKED_BYTES", 1 << 20)
    assert UNPACKED_BYTES > 1 << 20
    with zipfile.ZipFile(tmp_path / "x.fmu", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("x", bytes(3 << 20))
    with pytest.raises(ValueError, match="more than"):
        unpack(tmp_path / "x.fmu", tmp_path / "home")


HANGING = """
import sys
from pathlib import Path
from tests.plants.test_fmu_faults import simulate
print("begins", flush=True)
simulate(Path(sys.argv[1]))
"""


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
@pytest.mark.parametrize("number", [signal.SIGTERM, campaign(signal.SIGINT), campaign(signal.SIGKILL)])
def test_an_fmu_that_hangs_ends_with_its_command(tmp_path: Path, home: Path, number: signal.Signals) -> None:
    loads = tmp_path / "loads"
    path = fmu(tmp_path, f'{{ creat("{loads}", 0600); for (;;) pause(); }}')
    command = subprocess.Popen(
        [sys.executable, "-c", HANGING, str(path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "TMPDIR": str(home)},
    )
    with command:  # which waits for its end, also where an assertion fails
        try:
            assert command.stdout is not None
            command.stdout.readline()
            until = time.monotonic() + 90
            while not loads.exists() and time.monotonic() < until:
                time.sleep(0.05)
            assert loads.exists()
            command.send_signal(number)
            assert command.wait(90) != 0
            while list(home.iterdir()) and time.monotonic() < until:
                time.sleep(0.05)
            assert not list(home.iterdir())
        finally:
            command.kill()
