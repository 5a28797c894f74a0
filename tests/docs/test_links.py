"""Every link of the documentation leads somewhere, and every page can be reached from its map."""

from pathlib import Path

import pytest

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
