"""The worked examples of docs/extend.md, carried out on a copy of the packages exactly as they are printed."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.chosen import one_in
from tests.docs.pages import DOCS, ROOT, Block, blocks

COPIED = ("drivers", "eds", "estimator", "examples", "hil")
EXTEND = blocks(DOCS / "extend.md")
TRIALS = [block.text for block in EXTEND if block.language == "python" and not block.title]


def hunks(diff: str) -> list[tuple[str, str]]:
    """Return what each hunk of a diff takes away and what it puts there, context included."""
    parts = [part.splitlines() for part in diff.split("@@\n") if part]
    return [(_side(lines, "-"), _side(lines, "+")) for lines in parts]


def _side(lines: list[str], sign: str) -> str:
    return "\n".join(line[1:] for line in lines if line[:1] in (" ", sign, "")) + "\n"


def carry_out(block: Block, folder: Path) -> None:
    path = folder / block.title
    if block.language != "diff":
        assert not path.exists(), f"{block.title} exists by now: choose another example"
        path.write_text(block.text, encoding="utf-8")
        return
    text = path.read_text(encoding="utf-8")
    for before, after in hunks(block.text):
        assert text.count(before) == 1, f"{block.title} does not hold this once:\n{before}"
        text = text.replace(before, after)
    path.write_text(text, encoding="utf-8")


@pytest.fixture(scope="module")
def extended(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a copy of the packages with everything of the page carried out."""
    folder = tmp_path_factory.mktemp("extended")
    for name in COPIED:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for block in EXTEND:
        if block.title:
            carry_out(block, folder)
    return folder


def test_the_page_has_an_example_of_each_kind() -> None:
    assert len(TRIALS) == 4
    assert sum(block.language == "diff" for block in EXTEND) == 4


def test_the_effect_of_the_page_takes_one_file_and_two_lines() -> None:
    mine = [block for block in EXTEND if block.title and "physics" in block.title]
    added = [line for block in mine if block.language == "diff" for line in block.text.splitlines() if line[:1] == "+"]
    assert sum(block.language != "diff" for block in mine) == 1
    assert len(added) == 2


@pytest.mark.parametrize("number", one_in(2, range(len(TRIALS))), ids=["effect", "law", "experiment", "format"])
def test_the_example_runs_as_printed(extended: Path, number: int) -> None:
    script = extended / f"trial_{number}.py"
    script.write_text(TRIALS[number], encoding="utf-8")
    # Interpreted, the few samples of an example are simulated sooner than the simulation is compiled.
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, script.name], cwd=extended, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_the_copy_is_what_runs(extended: Path) -> None:
    """Without this the examples might be tried on the installed packages, which lack them."""
    program = "import estimator.physics.catalogue as c; print(c.__file__); print('rubber_memory' in c.EFFECTS)"
    done = subprocess.run([sys.executable, "-c", program], cwd=extended, capture_output=True, text=True, check=True)
    file, known = done.stdout.splitlines()
    assert Path(file).is_relative_to(extended)
    assert known == "True"


def test_the_shipped_catalogue_has_not_been_touched() -> None:
    from estimator.physics.catalogue import EFFECTS

    assert "rubber_memory" not in EFFECTS
