"""``hil demo`` as a user starts and stops it."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console

from drivers.canopen.can_link import CanLink
from drivers.errors import BusDown, ConfigMismatch
from hil.cli import demo as demo_module
from hil.cli.demo import _Demo
from hil.cli.main import run
from hil.config.rig_file import read_rig
from hil.proof.rigs import sealed_process
from hil.proof.seal import verify
from tests.docs.gallery.case import skeleton
from tests.docs.pages import DOCS, ROOT, blocks

SEED_OF_NONE = 115
"""A seed whose bus hides nothing: the quickest to diagnose."""

SEED_OF_PAGES = "102"
"""What README and manual show of a demo is of this seed."""


@pytest.mark.campaign
@pytest.mark.parametrize("stop", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.campaign)])
def test_an_interrupted_demo_leaves_nothing_running_and_nothing_half_written(tmp_path, stop):
    workshop, out = tmp_path / "tmp", tmp_path / "out"
    workshop.mkdir()
    demo = subprocess.Popen(
        [sys.executable, "-m", "hil", "demo", "--seed", "5", "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "TMPDIR": str(workshop), "PYTHONUNBUFFERED": "1", "COLUMNS": "200"},
    )
    url = None
    for line in demo.stdout:
        url = url or re.search(r"ws://\S+/", line)
        if line.startswith("3/6"):
            break
    demo.send_signal(stop)
    demo.communicate(timeout=60)
    assert demo.returncode == 130
    assert not out.exists()
    assert list(workshop.iterdir()) == []
    with pytest.raises(BusDown):
        CanLink.open(url.group())


@pytest.mark.campaign
def test_the_rig_file_has_the_addresses_of_this_run_and_a_device_that_differs_ends_it(tmp_path):
    demo = _Demo(Console(quiet=True), 5, tmp_path, tmp_path / "out")
    with sealed_process("--seed", "5") as sealed:
        rig = demo._rig(sealed)
        assert rig.can.url == sealed.bus
        assert f"{rig.plc.host}:{rig.plc.port}" == sealed.modbus
        demo._check(rig)
        other = demo._rig_path.read_text().replace("product_code = 0x402", "product_code = 0x403", 1)
        demo._rig_path.write_text(other)
        with pytest.raises(ConfigMismatch, match=r"m1: .*expected .*0x0*403.*found .*0x0*402"):
            demo._check(read_rig(demo._rig_path))
    assert not Path(tmp_path / "out").exists()


def test_the_whole_job_ends_with_a_judged_verdict_and_a_seal_that_verifies(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(demo_module, "EXPERIMENTS", ("cruise",))  # one test instead of three: quicker
    assert run(["demo", "--seed", str(SEED_OF_NONE), "--out", str(tmp_path)]) == 0
    said = capsys.readouterr().out
    assert "seal opened: right" in said
    assert f"hil demo --seed {SEED_OF_NONE}" in said
    seal = json.loads((tmp_path / "seal.json").read_text())
    truth = verify(seal["commitment"], seal["opened"])
    assert seal["commitment"] in said
    judgement = json.loads((tmp_path / "judgement.json").read_text())
    assert (truth["effect"], judgement["outcome"], judgement["named"]) == ("none", "right", [])
    inertia = next(size for size in judgement["sizes"] if size["what"] == "J_M")
    assert inertia["found"] == pytest.approx(truth["true"]["J_M"], rel=0.01)
    names = {"cruise.csv", "nominal.toml", "rig.toml", "diagnosis.json", "augmented.toml", "report.html"}
    assert {path.name for path in tmp_path.iterdir()} == names | {"seal.json", "judgement.json"}


@pytest.mark.campaign
@pytest.mark.timeout(1800)  # three experiments are driven and diagnosed
def test_the_pages_show_what_the_demo_prints_except_for_its_numbers(tmp_path, capsys):
    assert run(["demo", "--seed", SEED_OF_PAGES, "--out", str(tmp_path)]) == 0
    said = skeleton(capsys.readouterr().out)
    for page in (ROOT / "README.md", DOCS / "get-started.md"):
        (shown,) = (block.text for block in blocks(page) if "seal opened" in block.text)
        lines = [line for line in shown.splitlines() if not any(each in line for each in ("...", "commit", "report"))]
        assert [line for line in lines if skeleton(line).strip() not in said] == []
