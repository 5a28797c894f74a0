"""``hil export st`` on real files: what it writes, what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from estimator.identification.identify import Settings
from estimator.signals.record import Record
from hil.cli.main import run
from hil.export.plc_estimator import PlcEstimator
from hil.export.structured_text import Precision, structured_text
from hil.report.identification.document import identification_text

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "estimator.st"


@pytest.fixture(scope="module")
def identified(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from estimator.identification.identify import identify
    from tests.estimator.identification.driveline import cruise

    records: list[Record] = [cruise(seed, duration_s=15.0, name=f"run_{seed}").record for seed in (1, 2)]
    settings = Settings()
    path = tmp_path_factory.mktemp("identified") / "identification.json"
    text = identification_text([identify(record, settings) for record in records], settings, None)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("option", "precision"), [((), Precision.DOUBLE), (("--single",), Precision.SINGLE)])
def test_the_filter_and_the_settings_are_those_of_the_run(
    identified: Path, tmp_path: Path, option: tuple[str, ...], precision: Precision
) -> None:
    out = tmp_path / "new" / "estimator.st"
    assert run(["export", "st", str(identified), "--run", "run_2", "--out", str(out), *option]) == 0
    L = json.loads(identified.read_text())["recordings"][1]["filter_L"]
    expected = PlcEstimator(Settings(), 0.01, np.array(L), "identification.json, recording run_2")
    assert out.read_text(encoding="ascii") == structured_text(expected, precision)


def test_without_a_model_the_filter_is_adapted(tmp_path: Path) -> None:
    out = tmp_path / "estimator.st"
    assert run(["export", "st", "--adaptive", "--cycle", "0.02", "--out", str(out)]) == 0
    text = out.read_text(encoding="ascii")
    assert "ADAPT_FILTER : BOOL := TRUE;" in text
    assert "Call it once per cycle of 0.02 s" in text


def test_the_example_is_what_the_command_writes_today(tmp_path: Path) -> None:
    out = tmp_path / "estimator.st"
    assert run(["export", "st", "--adaptive", "--out", str(out)]) == 0
    assert EXAMPLE.read_text(encoding="ascii") == out.read_text(encoding="ascii"), (
        "bring it up to date by: hil export st --adaptive --out examples/estimator.st"
    )


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["FILE", "--run", "run_3"], "run_1, run_2"),
        (["FILE"], "named by --run: run_1, run_2"),
        (["FILE", "--run", "run_1", "--cycle", "0.003"], "0.02 s"),
        (["FILE", "--run", "run_1", "--profile", "wild"], "decreasing_gain"),
        (["FILE", "--run", "run_1", "--profile", "constant_forgetting:lambda1=x"], "lambda1=number"),
        (["FILE", "--run", "run_1", "--profile", "constant_forgetting:lambda=1"], "lambda1, initial_gain"),
        (["FILE", "--run", "run_1", "--profile", "constant_forgetting:lambda1=2"], "at most 1"),
        (["FILE", "--run", "run_1", "--profile", "constant_forgetting:lambda1=1,lambda1=1"], "at most once"),
        ([], "--adaptive"),
        (["--adaptive", "--run", "run_1"], "came no file"),
    ],
)
def test_wrong_use_is_refused(
    identified: Path, tmp_path: Path, arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [str(identified) if word == "FILE" else word for word in arguments]
    assert run(["export", "st", *given, "--out", str(tmp_path / "estimator.st")]) == 2
    assert said in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "line 1 | expected JSON"),
        (b"[]", "a JSON object"),
        (b"\xff\xfe", "UTF-8"),
        (b"{}", "schema | expected this key"),
        (b'{"schema": "hil.diagnosis/1"}', "schema | expected 'hil.identification/1'"),
    ],
)
def test_a_wrong_file_is_refused_by_place(
    content: bytes, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = tmp_path / "identification.json", tmp_path / "estimator.st"
    path.write_bytes(content)
    assert run(["export", "st", str(path), "--out", str(out)]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()


def _changed(identified: Path, folder: Path, **changes: object) -> Path:
    document = json.loads(identified.read_text())
    document["recordings"][0].update(changes)
    path = folder / "identification.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"output": "position"}, "expected 'speed'"),
        ({"filter_L": [1.0, -1.2]}, "root of magnitude 1.2"),
        ({"filter_L": []}, "recordings.0.filter_L"),
        ({"filter_L": ["1"]}, "recordings.0.filter_L.0"),
    ],
)
def test_a_model_that_can_not_serve_is_refused(
    identified: Path, tmp_path: Path, changes: dict[str, object], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path, out = _changed(identified, tmp_path, **changes), tmp_path / "estimator.st"
    assert run(["export", "st", str(path), "--run", "run_1", "--out", str(out)]) == 2
    assert said in capsys.readouterr().err
    assert not out.exists()
