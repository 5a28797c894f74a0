"""One self-contained HTML page from pieces: style and scripts inside, nothing is fetched."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from importlib.resources import files

from hil.report.figures import plotly_script


def page(title: str, body: Iterable[str], footer: str, *, plots: bool = True) -> str:
    """Put sections into a page; ``body`` is HTML already, ``title`` and ``footer`` are text.

    ``plots`` brings the script that draws figures along, which is megabytes.
    """
    style = files("hil.report").joinpath("page.css").read_text(encoding="utf-8")
    script = plotly_script() if plots else ""
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>\n{style}</style>\n{script}\n</head>\n<body>\n<main>\n"
        + "\n".join(body)
        + f"\n<footer>{escape(footer)}</footer>\n</main>\n</body>\n</html>\n"
    )


def section(title: str, *pieces: str) -> str:
    """Frame pieces of HTML under a heading."""
    inside = "\n".join(pieces)
    return f"<section>\n<h2>{escape(title)}</h2>\n{inside}\n</section>"


def paragraph(text: str, kind: str = "") -> str:
    """Put text into a paragraph of a CSS class."""
    return f'<p class="{kind}">{escape(text)}</p>' if kind else f"<p>{escape(text)}</p>"


def table(headings: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Make a table of text; columns in ``numbers`` (from 0) are flush right; no headings, no head."""
    return html_table(headings, [[escape(cell) for cell in row] for row in rows], numbers)


def html_table(headings: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Make a table of cells that are HTML already."""

    def cell(tag: str, column: int, content: str) -> str:
        kind = ' class="number"' if column in numbers else ""
        return f"<{tag}{kind}>{content}</{tag}>"

    titles = "".join(cell("th", i, escape(text)) for i, text in enumerate(headings))
    head = f"<thead><tr>{titles}</tr></thead>\n" if any(headings) else ""
    lines = ["<tr>" + "".join(cell("td", i, text) for i, text in enumerate(row)) + "</tr>" for row in rows]
    return f'<div class="wide"><table>\n{head}<tbody>\n' + "\n".join(lines) + "\n</tbody></table></div>"


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
