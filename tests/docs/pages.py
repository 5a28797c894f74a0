"""The documentation as text: its pages, links, code blocks and command lines."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

_BLOCK = re.compile(r"^```(?P<language>[\w{}-]*)(?: title=\"(?P<title>[^\"]+)\")?\n(?P<text>.*?)^```$", re.M | re.S)
_INLINE = re.compile(r"(?<!`)`(hil [^`\n]+)`(?!`)")
_LINK = re.compile(r"\[[^\]]*\]\((?P<target>[^)\s]+)\)")


@dataclass(frozen=True, slots=True)
class Block:
    """A fenced block: its language, the file it is (empty where it is none), its text."""

    language: str
    title: str
    text: str


def pages() -> list[Path]:
    """Return every page a reader may open, the two at the top included."""
    return [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted(DOCS.rglob("*.md"))]


def blocks(page: Path) -> list[Block]:
    """Return the fenced blocks of a page."""
    found = _BLOCK.finditer(page.read_text(encoding="utf-8"))
    return [Block(match["language"], match["title"] or "", match["text"]) for match in found]


def prose(page: Path) -> str:
    """Return a page without its fenced blocks."""
    return _BLOCK.sub("", page.read_text(encoding="utf-8"))


def links(page: Path) -> list[str]:
    """Return the targets of a page's links and pictures."""
    return [match["target"] for match in _LINK.finditer(prose(page))]


def command_lines(page: Path) -> Iterator[str]:
    """Yield every command line ``hil ...`` of a page's blocks."""
    for block in blocks(page):
        if block.language in ("", "console", "sh"):
            prompt = "$ " if block.language == "console" else ""  # what has none there is output
            for line in block.text.splitlines():
                bare = line.removeprefix(prompt)
                if line.startswith(prompt) and bare.startswith("hil "):
                    yield bare.removesuffix("&").strip()


def mentioned_commands(page: Path) -> list[str]:
    """Return every ``hil ...`` in a page's running text."""
    return _INLINE.findall(prose(page))


def anchor(heading: str) -> str:
    """Return the fragment under which a heading is reached."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def anchors(page: Path) -> set[str]:
    """Return the fragments of a page."""
    return {anchor(line.lstrip("#").strip()) for line in prose(page).splitlines() if line.startswith("#")}
