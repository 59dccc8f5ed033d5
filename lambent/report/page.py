"""A self-contained HTML page without external scripts, fonts or images.

Callers pass plain text and PNG bytes; this module escapes all text.
"""

from __future__ import annotations

import base64
import struct
from collections.abc import Iterable, Sequence
from html import escape

from lambent.core.outputs import MARK

STYLE = """
:root { color-scheme: light dark; --ink: #1c1e21; --soft: #5c6370; --line: #d9dce1; --page: #fff; --card: #f5f6f8;
  --mark: #8a5a00; --note: #fdf6e3; --note-line: #e5c97a; }
@media (prefers-color-scheme: dark) { :root { --ink: #e6e8eb; --soft: #9aa2ad; --line: #383d45; --page: #16181c;
  --card: #1f2228; --mark: #ffc857; --note: #2b2617; --note-line: #6b5a24; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); font: 16px/1.55 system-ui, "Segoe UI", "DejaVu Sans",
  sans-serif; }
main { max-width: 66rem; margin: 0 auto; padding: 3rem 1.5rem 4rem; }
h1 { font-size: 2rem; line-height: 1.2; margin: 0 0 .3rem; font-weight: 650; letter-spacing: -.01em;
  overflow-wrap: anywhere; }
h2 { font-size: 1.2rem; margin: 3rem 0 .8rem; font-weight: 650; }
p { max-width: 46rem; margin: .6rem 0; }
.lead { color: var(--soft); font-size: 1.05rem; margin: 0 0 1.5rem; }
.soft { color: var(--soft); }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; margin: .6rem 0; }
caption { text-align: left; color: var(--soft); padding-bottom: .4rem; }
th, td { text-align: left; vertical-align: top; padding: .38rem 1.1rem .38rem 0; border-bottom: 1px solid var(--line);
  overflow-wrap: break-word; }
.facts td { overflow-wrap: anywhere; }
thead th { color: var(--soft); font-weight: 500; font-size: .88rem; vertical-align: bottom; }
tbody th { font-weight: 500; }
td.number, th.number { text-align: right; white-space: nowrap; }
tr.chosen td, tr.chosen th { color: var(--mark); font-weight: 650; }
.scroll { overflow-x: auto; }
figure { margin: 1rem 0; }
figure img { display: block; max-width: 100%; height: auto; }
figure.paper img { background: #fff; border-radius: .4rem; }
figcaption { color: var(--soft); font-size: .9rem; margin-top: .4rem; max-width: 46rem; }
.row { display: grid; grid-template-columns: repeat(3, minmax(0, 1fr)); gap: 1rem; }
.row figure { margin: 0; text-align: center; }
.row img { width: 100%; }
aside { background: var(--note); border: 1px solid var(--note-line); border-radius: .4rem; padding: .7rem 1.1rem;
  margin: 1.2rem 0; }
aside p { margin: 0 0 .3rem; font-weight: 650; }
aside ul { margin: 0; padding-left: 1.1rem; }
ul { max-width: 46rem; }
footer { margin-top: 3rem; padding-top: .8rem; border-top: 1px solid var(--line); color: var(--soft);
  font-size: .88rem; }
@media (max-width: 40rem) { .row { grid-template-columns: 1fr; } main { padding-top: 1.5rem; } }
@media print { :root { color-scheme: light; --ink: #000; --soft: #444; --line: #bbb; --page: #fff; --card: #fff;
  --mark: #000; --note: #fff; --note-line: #666; } body { font-size: 10.5pt; } main { max-width: none; padding: 0; }
  h2 { break-after: avoid; } figure, tr, aside { break-inside: avoid; } @page { margin: 16mm; } }
"""


def page(title: str, body: Iterable[str]) -> str:
    """The whole document; `body` is HTML from the functions below."""
    head = (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta name="generator" content="{MARK}">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n"
    )
    return head + "<body>\n<main>\n" + "\n".join(body) + "\n</main>\n</body>\n</html>\n"


def heading(text: str, level: int = 2) -> str:
    return f"<h{level}>{escape(text)}</h{level}>"


def paragraph(text: str, kind: str = "") -> str:
    return f"<p{_class(kind)}>{escape(text)}</p>"


def bullets(lines: Iterable[str]) -> str:
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"


def note(title: str, lines: Iterable[str]) -> str:
    """A box that stands out at the top of the page."""
    return f"<aside><p>{escape(title)}</p>{bullets(lines)}</aside>"


def facts(rows: Iterable[tuple[str, str]]) -> str:
    """A table of names and values."""
    lines = "".join(f'<tr><th scope="row">{escape(name)}</th><td>{escape(value)}</td></tr>' for name, value in rows)
    return f'<div class="scroll"><table class="facts"><tbody>{lines}</tbody></table></div>'


def table(
    head: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    caption: str = "",
    numbers: Sequence[int] = (),
    chosen: int | None = None,
) -> str:
    """A table whose first column names the rows; columns `numbers` are right-aligned, row `chosen` is highlighted."""

    def cell(column: int, text: str, in_head: bool = False) -> str:
        kind = _class("number" if column in numbers else "")
        if in_head or column == 0:
            scope = "col" if in_head else "row"
            return f'<th scope="{scope}"{kind}>{escape(text)}</th>'
        return f"<td{kind}>{escape(text)}</td>"

    top = "".join(cell(i, text, in_head=True) for i, text in enumerate(head))
    lines = []
    for number, row in enumerate(rows):
        kind = _class("chosen" if number == chosen else "")
        lines.append(f"<tr{kind}>{''.join(cell(i, text) for i, text in enumerate(row))}</tr>")
    return (
        f'<div class="scroll"><table>{_caption(caption)}<thead><tr>{top}</tr></thead>'
        f"<tbody>{''.join(lines)}</tbody></table></div>"
    )


def picture(png: bytes, description: str, caption: str = "", *, density: float = 1.0, paper: bool = False) -> str:
    """A PNG figure, shown at its size divided by `density`; `paper` gives it a white background in dark mode."""
    width, height = struct.unpack(">II", png[16:24])
    uri = f"data:image/png;base64,{base64.b64encode(png).decode()}"
    size = f'width="{round(width / density)}" height="{round(height / density)}"'
    shown = f'<img src="{uri}" alt="{escape(description, quote=True)}" {size}>'
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    return f"<figure{_class('paper' if paper else '')}>{shown}{below}</figure>"


def row(parts: Iterable[str]) -> str:
    """Figures side by side."""
    return f'<div class="row">{"".join(parts)}</div>'


def footer(text: str) -> str:
    return f"<footer>{escape(text)}</footer>"


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""


def _caption(text: str) -> str:
    return f"<caption>{escape(text)}</caption>" if text else ""
