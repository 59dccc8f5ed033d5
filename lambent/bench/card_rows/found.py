"""The rows of bench `card`, by name, in the order of their turns."""

from __future__ import annotations

from lambent.bench import card_rows
from lambent.bench.card_rows.row import Row
from lambent.core.discovery import modules_in


def rows() -> dict[str, Row]:
    found = {name: row for module in modules_in(card_rows, having="ROWS").values() for name, row in module.ROWS.items()}
    return dict(sorted(found.items(), key=lambda one: one[1].turn))
