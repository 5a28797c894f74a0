"""``hil rig schema`` and ``hil model schema``: an editor takes what the program takes, and marks what it refuses."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from estimator.physics.model import DrivelineModel, Parameter, Structure
from hil.config.model_file import read_model, write_model
from hil.config.schema import json_schema
from hil.config.table import FileKind, schema_line
from tests.docs.pages import blocks, pages

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
TEXTS = [path.read_text(encoding="utf-8") for path in sorted(EXAMPLES.glob("*.toml"))]
DOCUMENTED = [block.text for page in pages() for block in blocks(page) if 'schema = "hil.' in block.text]


def faults(kind: FileKind, document: dict[str, Any]) -> list[str]:
    """Return where a document breaks the schema of its kind, and how."""
    found = Draft202012Validator(json_schema(kind)).iter_errors(document)
    return [f"{'.'.join(map(str, each.absolute_path))}: {each.message}" for each in found]


def kind_of(document: dict[str, Any]) -> FileKind | None:
    return {"hil.rig/1": FileKind.RIG, "hil.model/1": FileKind.MODEL}.get(document.get("schema", ""))


@pytest.mark.parametrize("text", [*TEXTS, *DOCUMENTED])
def test_every_example_fits_its_schema(text: str) -> None:
    document = tomllib.loads(text)
    kind = kind_of(document)
    assert kind is not None
    assert faults(kind, document) == []


def changed(text: str, before: str, after: str) -> dict[str, Any]:
    assert before in text
    return tomllib.loads(text.replace(before, after, 1))


@pytest.mark.parametrize(
    ("before", "after", "place"),
    [
        ("period_s = 0.01 ", 'period_s = "10ms" ', "period_s"),
        ("node_id = 1 ", "node_id = 200 ", "inverters.m1.node_id"),
        ("node_id = 1 ", "node = 1 ", "inverters.m1: "),
        ('mode = "cyclic_synchronous_torque"', 'mode = "torque"', "inverters.m1.mode"),
        ('mode = "cyclic_synchronous_torque"', "mode = 10", "inverters.m1.mode"),
        ("torque_limit_nm = 400.0", "torque_limit_nm = 0.0", "inverters.m1.torque_limit_nm"),
        ('source = "host"', 'source = "me"', "prbs.source"),
        ('kind = "cruise"', 'kind = "stroll"', "experiments.cruise"),
        ('[plc]\nhost = "127.0.0.1"', "[plc]", "plc: 'host'"),
    ],
)
def test_a_fault_of_a_rig_file_is_marked(before: str, after: str, place: str) -> None:
    document = changed((EXAMPLES / "rig.toml").read_text(encoding="utf-8"), before, after)
    assert [fault for fault in faults(FileKind.RIG, document) if fault.startswith(place)]


def test_a_model_file_that_is_written_names_its_schema_and_fits_it(tmp_path: Path) -> None:
    values = {"J_M": 1.6, "b_M": 0.35}
    model = DrivelineModel(Structure.ONE_MASS, {name: Parameter(value, 0.2) for name, value in values.items()})
    write_model(tmp_path / "model.toml", model)
    text = (tmp_path / "model.toml").read_text(encoding="utf-8")
    assert text.splitlines()[0] == schema_line(FileKind.MODEL) == "#:schema ./model.schema.json"
    assert faults(FileKind.MODEL, tomllib.loads(text)) == []
    assert read_model(tmp_path / "model.toml").model == model
