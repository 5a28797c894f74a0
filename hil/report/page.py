"""One self-contained HTML page from pieces: style and scripts inside, nothing is fetched.

A page can be read with a keyboard alone: a link over what is the same on every page, a list of its sections, figures
that take keys (`page.js`). Figures are drawn one by one, those in view first, so that a long page opens at once.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files

from hil.report.figures import plotly_script

FEWEST_LISTED = 3
"""Sections from which on a page begins with a list of them."""

LONGEST_WORDS = 30
"""Characters of a cell that fit a line of a narrow screen; longer ones are sentences and get room for some words."""

KEYS = (
    "A figure that has the focus takes keys: + and - zoom, the arrows move, 1 to 9 show or hide a line, 0 shows all "
    "again."
)


def page(title: str, body: Iterable[str], footer: str, *, plots: bool = True) -> str:
    """Put sections into a page; ``body`` is HTML already, ``title`` and ``footer`` are text.

    ``plots`` brings the script that draws figures along, which is megabytes.
    """
    style, behaviour = (_file(name) for name in ("page.css", "page.js"))
    script = plotly_script() if plots else ""
    sections = "\n".join(body)
    keys = f'<p class="note keys">{escape(KEYS)}</p>\n' if plots else ""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n</head>\n<body>\n"
        '<a class="skip" href="#main">Skip to the content</a>\n'
        f'{_contents(sections)}<main id="main" tabindex="-1">\n{sections}\n'
        f"<footer>{keys}<p>{escape(footer)}</p></footer>\n</main>\n{script}<script>\n{behaviour}</script>\n</body>\n</html>\n"
    )


def _file(name: str) -> str:
    return files("hil.report").joinpath(name).read_text(encoding="utf-8")


def _contents(sections: str) -> str:
    """List the sections of a page as links; nothing where there are few."""
    found = re.findall(r'<section id="([^"]+)">\n<h2>(.*?)</h2>', sections)  # as `section` makes them
    if len(found) < FEWEST_LISTED:
        return ""
    links = "".join(f'<li><a href="#{name}">{title}</a></li>' for name, title in found)
    return f'<nav aria-label="Sections"><ul>{links}</ul></nav>\n'


def section(title: str, *pieces: str) -> str:
    """Frame pieces of HTML under a heading; the page's titles must differ, its addresses are made of them."""
    inside = "\n".join(pieces)
    return f'<section id="{_address(title)}">\n<h2>{escape(title)}</h2>\n{inside}\n</section>'


def _address(title: str) -> str:
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "section"


def paragraph(text: str, kind: str = "") -> str:
    """Put text into a paragraph of a CSS class."""
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def details(summary: str, *pieces: str) -> str:
    """Fold pieces of HTML away under a line that opens them; on paper they are open."""
    inside = "\n".join(pieces)
    return f"<details>\n<summary>{escape(summary)}</summary>\n{inside}\n</details>"


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Make a table of text; columns in ``numbers`` (from 0) are flush right; no headings, no head."""
    return html_table(headings, [[escape(cell) for cell in row] for row in rows], numbers)


def html_table(headings: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Make a table of cells that are HTML already; a column with sentences in it is marked as prose."""
    rows = list(rows)
    kinds = dict.fromkeys(_prose(rows), "prose") | dict.fromkeys(numbers, "number")

    def cell(tag: str, column: int, content: str) -> str:
        kind = f' class="{kinds[column]}"' if column in kinds else ""
        return f"<{tag}{kind}>{content}</{tag}>"

    titles = "".join(cell("th", i, escape(text)) for i, text in enumerate(headings))
    head = f"<thead><tr>{titles}</tr></thead>\n" if any(headings) else ""
    lines = ["<tr>" + "".join(cell("td", i, text) for i, text in enumerate(row)) + "</tr>" for row in rows]
    return f'<div class="wide"><table>\n{head}<tbody>\n' + "\n".join(lines) + "\n</tbody></table></div>"


def _prose(rows: Sequence[Sequence[str]]) -> set[int]:
    """Return the columns, but the first, with cells too long for one line of a narrow screen."""
    cells = ((i, re.sub(r"<[^>]*>", "", text)) for row in rows for i, text in enumerate(row))
    return {i for i, text in cells if i and len(text) > LONGEST_WORDS}


def tiles(entries: Iterable[tuple[str, str, str]]) -> str:
    """Show a few figures large: name, value, remark."""
    boxes = "".join(
        f'<div class="tile"><span class="name">{escape(name)}</span>'
        f'<span class="value">{escape(value)}</span><span class="remark">{escape(remark)}</span></div>'
        for name, value, remark in entries
    )
    return f'<div class="tiles">{boxes}</div>'


def bar(share: float, kind: str) -> str:
    """Draw a bar of a share from 0 to 1 of its cell."""
    percent = 100.0 * min(max(share, 0.0), 1.0)
    return f'<div class="bar {kind}" style="width:{percent:.1f}%"></div>'
