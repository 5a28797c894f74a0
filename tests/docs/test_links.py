"""Pages of the manual: they are built, their links lead somewhere, and what is made by program is fresh."""

import ast
import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import nbformat
import pytest

from tests.docs.gallery.case import skeleton, tell
from tests.docs.gallery.draw import FOLDER
from tests.docs.gallery.page import FAILURES, PAGE, pictures, shown_of, shown_on_page, with_shown
from tests.docs.pages import DOCS, ROOT, anchors, links, pages

PAGES = pages()


def relative(page: Path) -> list[tuple[Path, str]]:
    """Return the file and fragment of each link that leads into the project."""
    targets = [target.partition("#") for target in links(page) if "://" not in target]
    return [((page.parent / path).resolve() if path else page, fragment) for path, _, fragment in targets]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    broken = [str(path) for path, _ in relative(page) if not path.exists()]
    lost = [f"{path.name}#{part}" for path, part in relative(page) if path.suffix == ".md" and part and path.exists()]
    lost = [each for each in lost if each.partition("#")[2] not in anchors_of(page, each.partition("#")[0])]
    assert not broken
    assert not lost


def anchors_of(page: Path, name: str) -> set[str]:
    return next(anchors(path) for path, _ in relative(page) if path.name == name)


def test_every_page_is_on_the_map() -> None:
    reached = {path for path, _ in relative(DOCS / "index.md")}
    assert [str(page) for page in DOCS.rglob("*.md") if page.resolve() not in reached | {(DOCS / "index.md")}] == []


def test_decisions_are_numbered_without_gaps() -> None:
    numbers = sorted(int(page.name.partition("-")[0]) for page in (DOCS / "decisions").glob("*.md"))
    assert numbers == list(range(1, len(numbers) + 1))


RENEW = "run: python -m tests.docs.gallery"
QUICK = [name for name, failure in FAILURES.items() if failure.quick]
MOST_BYTES = 1_500_000


def test_every_failure_has_its_place_cause_and_cure() -> None:
    shown = shown_on_page()
    assert set(shown) == set(FAILURES), "add or take out a place '<!-- shown: NAME -->' by hand"
    text = PAGE.read_text(encoding="utf-8")
    assert text.count("**Cause.**") == text.count("**Cure.**") == text.count("\n### ") == len(FAILURES)
    assert [name for name, part in shown.items() if "$ hil " not in part] == [], RENEW


def test_every_picture_is_shown_and_none_is_left_over() -> None:
    shown = {name for name, part in shown_on_page().items() if f"(images/gallery/{name}.svg)" in part}
    assert pictures() == shown, RENEW
    for path in FOLDER.glob("*"):
        assert ET.parse(path).getroot().tag.endswith("svg")
    assert sum(path.stat().st_size for path in FOLDER.glob("*")) < MOST_BYTES


@pytest.mark.parametrize("name", QUICK)
def test_the_tool_still_says_so(name: str) -> None:
    assert skeleton(shown_on_page()[name]) == skeleton(shown_of(name, tell(FAILURES[name]))), RENEW


def test_a_stale_place_is_noticed_and_mended() -> None:
    text = PAGE.read_text(encoding="utf-8")
    own = shown_on_page()["wrong_units"]
    stale = text.replace(own, own.replace("is the speed in rpm", "is all well"))
    assert stale != text
    assert skeleton(own) != skeleton(own.replace("is the speed in rpm", "is all well"))
    assert with_shown(stale, "wrong_units", own) == text


pytestmark = pytest.mark.skipif(
    any(find_spec(name) is None for name in ("sphinx", "myst_parser", "furo")),
    reason="needs Sphinx, MyST and Furo: python -m pip install --group docs",
)

FETCHED = re.compile(r"<(?:link|script|img)\b[^>]*?(?:href|src)=\"(?:https?:)?//[^\"]*\"")
"""What a browser loads by itself; a link that a reader follows is none of it."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build it as docs/index.md says, elsewhere."""
    folder = tmp_path_factory.mktemp("docs")
    options = ["-q", "-W", "--keep-going", "-b", "html", "-d", str(folder / "doctrees")]
    command = [sys.executable, "-m", "sphinx", *options, str(DOCS), str(folder / "html")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "html"


def test_every_page_is_built(site: Path) -> None:
    sources = [path.relative_to(DOCS).with_suffix(".html") for path in DOCS.rglob("*.md")]
    assert [str(each) for each in sources if not (site / each).is_file()] == []


def test_the_api_is_taken_from_the_source(site: Path) -> None:
    text = (site / "reference-api.html").read_text(encoding="utf-8")
    for name in ("estimator.diagnosis.diagnose", "drivers.torque_guard.TorqueGuard", "hil.recording.read_record"):
        assert f'id="{name}"' in text


def test_no_page_fetches_anything(site: Path) -> None:
    fetched = {str(page): FETCHED.findall(page.read_text(encoding="utf-8")) for page in site.rglob("*.html")}
    assert {page: found for page, found in fetched.items() if found} == {}
    styles = "".join(path.read_text(encoding="utf-8") for path in site.rglob("*.css"))
    assert re.findall(r"url\([\"']?(?:https?:)?//|@import", styles) == []


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
