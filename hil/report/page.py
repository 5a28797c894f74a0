"""A page's content as data, and the one self-contained HTML file that a template makes of it.

Pages are lists of blocks (headings, paragraphs, tables, figures); nobody but the templates writes markup. Jinja2
escapes every text in them, links keep to `is_allowed`, and the page's policy lets no script run but its own, by
their hashes. The same blocks are shown on a terminal by `hil.report.terminal`.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

FEWEST_LISTED = 3
"""Sections from which on a page begins with a list of them."""

LONGEST_WORDS = 30
"""Characters of a cell that fit a line of a narrow screen; longer ones are sentences and get room for some words."""

MOST_COLUMNS = 2
"""Columns of a table that fit next to one another on a narrow screen; with more each row becomes a card."""

SCHEMES = ("https", "http")
"""What a link may begin with, besides a path of a file next to the page."""


@dataclass(frozen=True, slots=True)
class Link:
    """A link; one that may not be followed (`is_allowed`) is shown as its text."""

    text: str  # to be read
    href: str  # file next to the page, or address

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Badge:
    """A word on a coloured ground."""

    text: str  # a word or two
    kind: str = ""  # class of the style sheet, its colour

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Code:
    """A name as it stands in a file."""

    text: str  # in a fixed width

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class Advised:
    """A value, and what to do about it."""

    text: str  # the value with its unit
    advice: str  # without a full stop

    def __str__(self) -> str:
        return f"{self.text} → {self.advice}"


@dataclass(frozen=True, slots=True)
class Bar:
    """A bar of a share, from 0 to 1, of its cell."""

    share: float  # of the cell's width
    kind: str  # class of the style sheet: before, after, floor

    @property
    def percent(self) -> float:
        """How much of the cell it fills."""
        return 100.0 * min(max(self.share, 0.0), 1.0)

    def __str__(self) -> str:
        return ""


@dataclass(frozen=True, slots=True)
class IntervalBar:
    """A parameter's tolerance, nominal value, value and interval as a drawing; x from 0 to 100 per cent."""

    label: str  # the same in words
    tolerance: tuple[float, float]  # x of its ends; the nominal value is at 50
    interval: tuple[float, float]  # x of its ends
    value: float  # x of the value

    def __str__(self) -> str:
        return ""


@dataclass(frozen=True, slots=True)
class HtmlRow:
    """A row of a table; ``kind`` is a class of the style sheet (outside, undetermined)."""

    cells: tuple[Any, ...]  # texts and inline pieces, one for each column
    kind: str = ""  # empty: none


@dataclass(frozen=True, slots=True)
class Heading:
    """A heading within a section, with a remark after it."""

    text: str  # one line
    remark: str = ""  # such as the element of an effect


@dataclass(frozen=True, slots=True)
class Paragraph:
    """A paragraph of texts and inline pieces."""

    pieces: tuple[Any, ...]  # without blanks between them
    kind: str = ""  # class of the style sheet, such as note or warning; empty: none


@dataclass(frozen=True, slots=True)
class Preformatted:
    """A text whose lines stay as they are."""

    text: str  # several lines


@dataclass(frozen=True, slots=True)
class HtmlTable:
    """A table; columns in ``numbers`` (from 0) are flush right, one with sentences in it is prose."""

    headings: tuple[str, ...]  # one for each column; empty: no head
    rows: tuple[HtmlRow, ...]  # may be empty
    numbers: frozenset[int] = frozenset()

    @property
    def is_wide(self) -> bool:
        """Whether a row becomes a card on a narrow screen."""
        return any(self.headings) and len(self.headings) > MOST_COLUMNS

    def kind(self, column: int) -> str:
        """Return the class of a column."""
        if column in self.numbers:
            return "number"
        is_prose = column and any(len(str(row.cells[column])) > LONGEST_WORDS for row in self.rows)
        return "prose" if is_prose else ""


@dataclass(frozen=True, slots=True)
class Details:
    """Blocks folded away under a line that opens them; on paper they are open."""

    summary: str  # the line that opens them
    blocks: tuple[Any, ...]  # of any kind


@dataclass(frozen=True, slots=True)
class Tiles:
    """A few figures, large: name, value, remark."""

    entries: tuple[tuple[str, str, str], ...]  # name, value, remark


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure that `page.js` draws: plotly's data and layout, and the samples to zoom to."""

    name: str  # unique in the page
    height_px: int  # of the whole figure
    content: str  # JSON

    @property
    def packed(self) -> str:
        """The content as gzip in base64."""
        return _packed(self.content.encode())


@dataclass(frozen=True, slots=True)
class Register:
    """A table of many rows that `register.js` filters, sorts and shows; cells are texts, numbers or None."""

    name: str  # unique in the page
    headings: tuple[str, ...]  # one for each column
    rows: Sequence[Sequence[Any]]  # a cell for each heading
    folder: str = ""  # of the JSON files that the texts of the last column lead to, if they do
    choose: bool = False  # whether the first cell of a row chooses whose courses are shown

    @property
    def packed(self) -> str:
        """The rows as gzip in base64."""
        content = {"headings": self.headings, "rows": self.rows, "folder": self.folder, "choose": self.choose}
        return _packed(json.dumps(content, allow_nan=False, separators=(",", ":")).encode())


@dataclass(frozen=True, slots=True)
class Courses:
    """The courses of each name's values, as `register.js` draws them for the one that is chosen."""

    hint: str  # shown while none is chosen
    of: Mapping[str, Sequence[Mapping[str, Any]]]  # by the first cell of a row of the register, what is drawn

    @property
    def packed(self) -> str:
        """The courses as gzip in base64."""
        return _packed(json.dumps(self.of, allow_nan=False, separators=(",", ":")).encode())


@dataclass(frozen=True, slots=True)
class Cut:
    """The stretch in view of a figure, as the lines of ``[signals]`` that cut it; `page.js` writes them."""

    figure: str  # name of the figure


@dataclass(frozen=True, slots=True)
class Picture:
    """An SVG drawing, shown as an image: nothing in it can run."""

    svg: str  # source
    label: str  # for who does not see it

    @property
    def address(self) -> str:
        """The drawing as an address."""
        return f"data:image/svg+xml;base64,{base64.b64encode(self.svg.encode()).decode('ascii')}"


@dataclass(frozen=True, slots=True)
class Header:
    """The head of a page: its badge, title, what it is of, and the blocks that come first."""

    title: str  # heading of the page
    kind: str  # class of the style sheet, of head and badge
    badge: str  # empty: none
    facts: tuple[tuple[str, str], ...]  # name and value
    blocks: tuple[Any, ...]  # of any kind


@dataclass(frozen=True, slots=True)
class Section:
    """Blocks under a heading; the page's titles must differ, its addresses are made of them."""

    title: str  # differs from those of the page's other sections
    blocks: tuple[Any, ...]  # of any kind

    @property
    def address(self) -> str:
        """Where in the page it is."""
        return re.sub(r"[^a-z0-9]+", "-", self.title.lower()).strip("-") or "section"


def header(title: str, *blocks: Any, kind: str = "", badge: str = "", facts: Iterable[tuple[str, str]] = ()) -> Header:
    """Make the head of a page; blocks that are empty are left out."""
    return Header(title, kind, badge, tuple(fact for fact in facts if fact[1]), _kept(blocks))


def section(title: str, *blocks: Any) -> Section:
    """Frame blocks under a heading; blocks that are empty are left out."""
    return Section(title, _kept(blocks))


def paragraph(*pieces: Any, kind: str = "") -> Paragraph:
    """Put texts and inline pieces into a paragraph of a class of the style sheet."""
    return Paragraph(pieces, kind)


def note(*pieces: Any) -> Paragraph:
    """Put a remark for the reader into a paragraph."""
    return Paragraph(pieces, "note")


def warning(*pieces: Any) -> Paragraph:
    """Put what a reader must know into a paragraph."""
    return Paragraph(pieces, "warning")


def details(summary: str, *blocks: Any) -> Details:
    """Fold blocks away under a line that opens them."""
    return Details(summary, _kept(blocks))


def table(headings: Sequence[str], rows: Iterable[Sequence[Any] | HtmlRow], numbers: Iterable[int] = ()) -> HtmlTable:
    """Make a table of texts and inline pieces; no headings, no head."""
    made = tuple(row if isinstance(row, HtmlRow) else HtmlRow(tuple(row)) for row in rows)
    return HtmlTable(tuple(headings), made, frozenset(numbers))


def table_of(
    items: Iterable[Any], columns: Sequence[tuple[str, Callable[[Any], Any]]], numbers: Iterable[int] = ()
) -> HtmlTable:
    """Make a table with a row for each item; a column has its heading and what gives a cell."""
    rows = [tuple(cell(item) for _, cell in columns) for item in items]
    return table([heading for heading, _ in columns], rows, numbers)


def tiles(entries: Iterable[tuple[str, str, str]]) -> Tiles:
    """Show a few figures large."""
    return Tiles(tuple(entries))


def _kept(blocks: Iterable[Any]) -> tuple[Any, ...]:
    """Leave out blocks that are empty; what comes as a list or one by one is put in its place."""
    kept: list[Any] = []
    for block in blocks:
        kept += _kept(block) if isinstance(block, list | tuple | Iterator) else [block] if block else []
    return tuple(kept)


def page(title: str, blocks: Iterable[Any], footer: str) -> str:
    """Return the HTML of a page; a script that draws is brought along where a figure is."""
    kept = _kept(blocks)
    has_figures, has_registers = any(_of_kind(Figure, kept)), any(_of_kind(Register, kept))
    sections = [block for block in kept if isinstance(block, Section)]
    behaviour, register = Markup(_text("page.js")), Markup(_text("register.js") if has_registers else "")
    scripts = [str(behaviour), str(register), *([plotly_bundle()] if has_figures else [])]
    return (
        _environment()
        .get_template("page.html")
        .render(
            title=title,
            blocks=kept,
            listed=sections if len(sections) >= FEWEST_LISTED else [],
            footer=footer,
            style=Markup(_text("page.css")),
            behaviour=behaviour,
            register=register,
            plotly=_packed(plotly_bundle().encode()) if has_figures else "",
            hashes=" ".join(f"'sha256-{_hash(script)}'" for script in scripts),
        )
    )


def fragment(*blocks: Any) -> str:
    """Return the HTML of blocks alone, for a notebook's cell."""
    return _environment().get_template("fragment.html").render(blocks=_kept(blocks))


def _of_kind(kind: type, blocks: Iterable[Any]) -> Iterable[Any]:
    for block in blocks:
        if isinstance(block, kind):
            yield block
        elif isinstance(block, Section | Header | Details):
            yield from _of_kind(kind, block.blocks)


def is_allowed(href: str) -> bool:
    """Whether a link may be followed: a path of a file next to the page, or an address of an allowed scheme.

    Browsers skip control characters in an address, so one with any of them, or a space, is none.
    """
    if re.search(r"[\x00-\x20\x7f\\]", href) or href.startswith("//"):
        return False
    scheme, colon, rest = href.partition(":")
    if not colon or re.search(r"[/?#]", scheme):
        return True
    return scheme.lower() in SCHEMES and rest.startswith("//")


def _refused(block: Any) -> str:
    raise TypeError(f"expected a block that the templates have, got {type(block).__name__}")


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("hil.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.filters["kind"] = lambda block: type(block).__name__
    environment.filters["refused"] = _refused
    environment.tests["allowed"] = is_allowed
    return environment


@cache
def _text(name: str) -> str:
    return files("hil.report").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def plotly_bundle() -> str:
    """Return plotly's basic bundle, which draws all figures here: scatter and bars."""
    packed = files("hil.report").joinpath("templates", "plotly-basic.min.js.gz").read_bytes()
    return gzip.decompress(packed).decode("utf-8")


@cache
def _packed(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode("ascii")


def _hash(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
