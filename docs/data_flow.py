"""Draws docs/pictures/data_flow.svg from the imports of the package: which package takes what from which.

.venv/bin/python docs/data_flow.py

A package stands right of all that it imports, with the names of its folders. An arrow leads from a package to one that
imports it, unless a longer way leads there too.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "lambent"
PICTURE = Path(__file__).parent / "pictures" / "data_flow.svg"
WIDTH, COLUMN = 100, 132  # of a box, and from one column to the next, in pixels
LINE, HEAD = 13, 26  # height of a folder's name, and of a package's
GAP, MARGIN = 22, 12
SWEEPS = 8  # that order the columns

Arrow = tuple[str, str]
Place = str | Arrow  # a package; or where an arrow passes a column: the column and the arrow's number


def imports() -> set[Arrow]:
    """(package, importer) of all imports between packages."""
    found = set()
    for path in PACKAGE.rglob("*.py"):
        importer, *inside = path.relative_to(PACKAGE).parts
        if inside:
            found |= {(package, importer) for package in _packages(path) if package != importer}
    return found


def _packages(path: Path) -> Iterator[str]:
    """The packages whose modules a file imports."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        parts = (name.split(".") for name in names)
        yield from (part[1] for part in parts if part[0] == "lambent" and part[1:] and (PACKAGE / part[1]).is_dir())


def columns(arrows: set[Arrow]) -> dict[str, int]:
    """Length of the longest way to each package from one that imports none."""
    column = dict.fromkeys(sorted({name for arrow in arrows for name in arrow}), 0)
    for _ in column:
        for source, target in arrows:
            column[target] = max(column[target], column[source] + 1)
    return column


def direct(arrows: set[Arrow]) -> set[Arrow]:
    """Arrows that no longer way replaces."""

    def leads(source: str, target: str) -> bool:
        return any(s == source and (t == target or leads(t, target)) for s, t in arrows)

    return {(s, t) for s, t in arrows if not any(m != t and leads(m, t) for o, m in arrows if o == s)}


def ways(column: dict[str, int], arrows: set[Arrow]) -> dict[Arrow, list[Place]]:
    """The places of each arrow: its source, one in each column that it passes, its target."""
    found: dict[Arrow, list[Place]] = {}
    for number, (source, target) in enumerate(sorted(arrows)):
        passed = [(str(c), str(number)) for c in range(column[source] + 1, column[target])]
        found[source, target] = [source, *passed, target]
    return found


def folders(package: str) -> list[str]:
    found = (path for path in (PACKAGE / package).iterdir() if path.is_dir() and not path.name.startswith("__"))
    return sorted(path.name for path in found if any(path.rglob("*.py")) or any(path.glob("*.wgsl")))


def size(place: Place) -> float:
    """Height of a place, in pixels."""
    return HEAD + LINE * len(folders(place)) if isinstance(place, str) else 0


def heights(column: dict[str, int], found: dict[Arrow, list[Place]]) -> dict[Place, float]:
    """Middle of each place, in pixels from the middle of the picture: near those that arrows tie it to."""
    at: dict[int, list[Place]] = {}
    for place in dict.fromkeys(place for way in found.values() for place in way):
        at.setdefault(column[place] if isinstance(place, str) else int(place[0]), []).append(place)
    tied = {pair for way in found.values() for left, right in pairwise(way) for pair in ((left, right), (right, left))}
    middle: dict[Place, float] = {}
    for _ in range(SWEEPS):
        for _, places in sorted(at.items()):
            near = {p: [middle[other] for one, other in tied if one == p and other in middle] for p in places}
            mean = {p: sum(near[p]) / len(near[p]) if near[p] else 0.0 for p in places}
            top = -(sum(map(size, places)) + GAP * (len(places) - 1)) / 2
            for place in sorted(places, key=mean.__getitem__):
                middle[place] = top + size(place) / 2
                top += size(place) + GAP
    return middle


def picture() -> str:
    every = imports()
    column = columns(every)
    found = ways(column, direct(every))
    middle = heights(column, found)
    top = min(middle[place] - size(place) / 2 for place in middle)
    bottom = max(middle[place] + size(place) / 2 for place in middle)

    def x(place: Place) -> int:
        return MARGIN + COLUMN * (column[place] if isinstance(place, str) else int(place[0]))

    def y(place: Place) -> float:
        return MARGIN + middle[place] - top

    parts = []
    for (source, target), way in sorted(found.items()):
        line = f"M{x(source) + WIDTH} {y(source):g}"
        for left, right in pairwise(way):
            end = x(right) - (5 if right == target else 0)
            bend = (x(left) + WIDTH + x(right)) / 2
            line += f"C{bend:g} {y(left):g} {bend:g} {y(right):g} {end} {y(right):g}"
            line += f"H{x(right) + WIDTH}" if right != target else ""
        parts.append(f'<path d="{line}"><title>{source} to {target}</title></path>')
    for name in column:
        above, centre = y(name) - size(name) / 2, x(name) + WIDTH // 2
        parts.append(f'<rect x="{x(name)}" y="{above:g}" width="{WIDTH}" height="{size(name):g}" rx="5"/>')
        parts.append(f'<text x="{centre}" y="{above + 18:g}">{name}</text>')
        for number, folder in enumerate(folders(name), 1):
            parts.append(f'<text class="folder" x="{centre}" y="{above + 18 + LINE * number:g}">{folder}</text>')
    return _sheet(parts, 2 * MARGIN + COLUMN * max(column.values()) + WIDTH, 2 * MARGIN + bottom - top)


def _sheet(parts: list[str], width: float, height: float) -> str:
    style = (
        "text{font:14px sans-serif;text-anchor:middle}.folder{font-size:11px;fill:#456}"
        "rect{fill:#eef3f8;stroke:#456}path{fill:none;stroke:#789;marker-end:url(#tip)}"
    )
    tip = (
        '<marker id="tip" markerWidth="8" markerHeight="8" refX="4" refY="3" orient="auto">'
        '<path d="M0 0L6 3L0 6z" style="fill:#789;stroke:none;marker-end:none"/></marker>'
    )
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" width="{width:g}">'
    white = '<rect width="100%" height="100%" style="fill:#fff;stroke:none"/>'
    return "\n".join([head, f"<style>{style}</style>", f"<defs>{tip}</defs>", white, *parts, "</svg>", ""])


if __name__ == "__main__":
    PICTURE.write_text(picture(), "utf-8")
    print(PICTURE)
