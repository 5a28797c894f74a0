"""What the reference pages list is what the program has: columns, flags, keys, registers, objects, thresholds."""

import json
import re
from pathlib import Path

import pytest
from pydantic import BaseModel

from drivers.inverter.drive_settings import OPTION_CODES
from drivers.plc.register_map import USED
from estimator.diagnosis.thresholds import Checks, Judging, Places, Searching
from hil.cli.main import ExitStatus
from hil.config.experiment_tables import AnyExperiment
from hil.config.model_file import read_model
from hil.config.rig_file import Rig
from hil.proof.seal import seal
from hil.proof.sealed_rig import CONCEALED
from hil.recording.columns import UNITS
from hil.recording.formats import FORMATS
from hil.sample import SampleFlag
from tests.cli import bench
from tests.docs.pages import DOCS, ROOT, blocks, pages


def text(page: str) -> str:
    return (DOCS / page).read_text(encoding="utf-8")


def names_in_code(page: str) -> set[str]:
    """Return every word that stands in backquotes on a page."""
    return {word for span in re.findall(r"`([^`\n]+)`", text(page)) for word in re.findall(r"\w+", span)}


def keys_of(model: type[BaseModel]) -> set[str]:
    """Return every key of a configuration, its tables included."""
    found: set[str] = set()
    for name, field in model.model_fields.items():
        found.add(field.alias or name)
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            found |= keys_of(field.annotation)
    return found


def test_every_column_and_format_is_listed() -> None:
    assert set(UNITS) <= names_in_code("formats.md")
    assert {suffix.removeprefix(".") for suffix in FORMATS} <= names_in_code("formats.md")


def test_every_flag_is_listed() -> None:
    listed = text("formats.md").partition("**Flags**")[2].partition("**Missing")[0]
    assert [int(value) for value in re.findall(r"^\| (\d+) \|", listed, re.M)] == [
        flag.value for flag in SampleFlag if flag
    ]


def test_every_key_of_a_rig_file_is_listed() -> None:
    documented = names_in_code("formats.md")
    assert keys_of(Rig) - documented == set()
    kinds: tuple[type[BaseModel], ...] = AnyExperiment.__args__[0].__args__  # type: ignore[attr-defined]
    for kind in kinds:
        assert keys_of(kind) - documented == set()


def test_every_register_the_plc_must_have_is_listed() -> None:
    assert set(USED) <= names_in_code("supported-protocols.md")


@pytest.mark.parametrize(
    "index", [*OPTION_CODES, 0x1005, 0x100C, 0x100D, 0x1016, 0x1017, 0x1018, 0x1400, 0x1600, 0x1800, 0x1A00]
)
def test_every_object_that_is_configured_is_listed(index: int) -> None:
    page = text("supported-protocols.md")
    first, last = 0x605A, 0x605E
    assert f"0x{index:04X}" in page or (first < index < last and f"0x{first:04X} to 0x{last:04X}" in page)


def test_the_thresholds_of_a_verdict_are_those_of_the_code() -> None:
    page = re.sub(r"\s+", " ", text("diagnosis.md"))
    for said in (
        f"blocks of {Judging.BLOCK_S:g} s every {Judging.EVERY_S:g} s",
        f"over {Places.WINDOW_S:g} s",
        f"central {Places.CENTRAL:.0%}".replace("%", " %"),
        f"whose share is below {Judging.LEAST_SHARE:g}",
    ):
        assert said in page
    assert Checks.LEAST_THROUGH == 0.2
    assert "lets through less than a fifth" in page
    assert "the five most promising effects" in page
    assert Searching.STARTS == 5


def test_every_concealed_effect_is_listed() -> None:
    assert set(CONCEALED) <= names_in_code("how-good.md")


MODELS = [
    pytest.param(page, block.text, id=page.name)
    for page in pages()
    for block in blocks(page)
    if block.language == "toml" and 'schema = "hil.model/1"' in block.text
]


@pytest.mark.parametrize(("page", "model"), MODELS)
def test_a_shown_model_file_is_one(page: Path, model: str, tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    for block in blocks(page):
        if block.language == "python" and block.title and "/" not in block.title:  # a module next to the model file
            (tmp_path / block.title).write_text(block.text, encoding="utf-8")
    path.write_text(model, encoding="utf-8")
    assert read_model(path, trust_laws=True).model.parameters


def test_the_shown_signals_are_read(tmp_path: Path) -> None:
    (signals,) = (block.text for block in blocks(DOCS / "formats.md") if block.text.startswith("[signals]"))
    path = tmp_path / "model.toml"
    own = (ROOT / "examples" / "emps.toml").read_text(encoding="utf-8").partition("[signals]")[0]
    path.write_text(own + signals, encoding="utf-8")
    file = read_model(path)
    assert file.signals is not None
    assert file.signals.mask[0].min == 2.0


def test_the_shown_check_of_a_seal_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (script,) = (block.text for block in blocks(DOCS / "how-good.md") if block.language == "python")
    sealed = seal({"effect": "backlash", "hidden": {"backlash": {"gap_rad": 0.02}}})
    folder = tmp_path / "out" / "demo"
    folder.mkdir(parents=True)
    content = {"commitment": sealed.commitment, "opened": sealed.opened()}
    (folder / "seal.json").write_text(json.dumps(content), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    exec(compile(script, "how-good.md", "exec"), {})
    assert capsys.readouterr().out.startswith("backlash {")


def test_the_verdict_from_python_is_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (script,) = (block.text for block in blocks(DOCS / "reference-api.md") if block.language == "python")
    for seed, name in enumerate(("cruise", "reversal", "tip")):
        bench.record(tmp_path / f"{name}.csv", seed, noise=0.02, n=600)
    bench.model(tmp_path / "model.toml")
    monkeypatch.chdir(tmp_path)
    exec(compile(script, "reference-api.md", "exec"), {})
    assert "Nothing is missing" in capsys.readouterr().out


def test_every_exit_status_is_explained() -> None:
    listed = re.findall(r"^\| (\d+) \|", text("reference-commands.md"), re.M)
    assert [int(status) for status in listed] == [status.value for status in ExitStatus]
