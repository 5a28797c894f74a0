"""The commit that results name: of a checkout, of one that was changed, of a folder that is no checkout, of a copy."""

import json
import re
import subprocess
from pathlib import Path

import pytest

from hil import version
from hil.provenance import provenance


def git(folder: Path, *words: str) -> str:
    who = ("-c", "user.name=a", "-c", "user.email=a@example.org")
    line = ("git", "-C", str(folder), *who, *words)
    return subprocess.run(line, capture_output=True, text=True, check=True).stdout.strip()


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.delenv("GIT_DIR", raising=False)
    for room in ("hil", "drivers", "estimator"):
        (tmp_path / room).mkdir()
        (tmp_path / room / "a.py").write_text("a = 1\n")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "first")
    return tmp_path


def test_a_checkout_has_its_commit_and_says_where_the_program_was_changed(checkout: Path) -> None:
    head = git(checkout, "rev-parse", "HEAD")[:12]
    (checkout / "notes.txt").write_text("not of the program")
    assert version.commit_of(checkout) == head
    (checkout / "hil" / "a.py").write_text("a = 2\n")
    assert version.commit_of(checkout) == f"{head}, changed"


def test_a_missing_library_is_installed_by_its_own_name_since_no_index_has_this_project(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert re.fullmatch(r"pip install '(?i:fmpy)>=[\d.]+'", version.install_hint("fmu"))
    assert version.install_hint("formats").count("'") == 6
    monkeypatch.setattr(version, "DISTRIBUTION", "not-installed-here")
    assert version.install_hint("fmu") == "pip install '.[fmu]' in the folder of this project"


def test_no_commit_of_a_repository_that_the_program_only_lies_in(checkout: Path) -> None:
    (checkout / "site-packages").mkdir()
    assert version.commit_of(checkout / "site-packages") == ""


def test_the_repository_that_a_hook_names_is_not_asked(checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GIT_DIR", str(checkout / "nowhere"))
    assert re.fullmatch("[0-9a-f]{12}", version.commit_of(checkout))


def test_a_built_copy_names_the_commit_that_it_was_built_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / version.COMMIT_FILE).write_text("0123456789ab\n")
    monkeypatch.setattr(version, "PACKAGE", tmp_path)
    version.program.cache_clear()
    made = json.loads(json.dumps(provenance().document()))
    version.program.cache_clear()
    assert made["program"] == f"hil {version.__version__} (0123456789ab)"
