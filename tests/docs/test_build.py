"""The documentation builds as a site, whole and without a warning, and a reader of it is never sent to the net."""

import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.docs.pages import DOCS

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
