"""The notebook of the documentation runs from top to bottom, and finds what it hides."""

import ast
import json
from pathlib import Path
from typing import Any

import nbformat
import pytest

from tests.docs.pages import DOCS

NOTEBOOK = DOCS / "python.ipynb"


def shown(cell: str, names: dict[str, Any]) -> Any:
    """Run a cell and return the value of its last expression, as a notebook shows it."""
    nodes = ast.parse(cell).body
    last = nodes.pop() if isinstance(nodes[-1], ast.Expr) else None
    exec(compile(ast.Module(nodes, []), "cell", "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), "cell", "eval"), names)


def test_it_is_a_notebook_without_outputs() -> None:
    nbformat.validate(nbformat.read(NOTEBOOK, as_version=4))
    cells = json.loads(NOTEBOOK.read_text())["cells"]
    assert all(not cell.get("outputs") for cell in cells)


def test_it_runs_and_names_the_friction(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "notebook"}
    cells = [cell["source"] for cell in nbformat.read(NOTEBOOK, as_version=4)["cells"] if cell["cell_type"] == "code"]
    values = [shown(cell, names) for cell in cells]
    assert names["result"].effects == ("coulomb_friction_motor",)
    frame = names["result"].to_dataframe()
    assert frame.loc[("coulomb_friction_motor", "friction_nm"), "value"] == pytest.approx(4.0, rel=0.05)
    before, after = names["compared"].to_dataframe()["rms"]
    assert after < 0.1 * before
    assert [value for value in values if isinstance(value, list)] == [
        ["augmented.toml", "diagnosis.json", "report.html"]
    ]
