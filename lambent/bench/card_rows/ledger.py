"""The file of bench `card`: rows as soon as they are measured, so that a run which dies keeps them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lambent.bench.card_rows.row import Row
from lambent.core.errors import UserError
from lambent.core.files import check_place, write_text
from lambent.core.inputs import parse_json, read_bytes

BENCH, MADE_WITH, DONE, FIGURES = "bench", "made_with", "done", "rows"
NAME = "card"
FIGURE = ("name", "value", "unit", "device")
MOST_BYTES = 1 << 22


@dataclass
class Ledger:
    """Figures of the `known` rows, reasons of those without (all) figures, and what is done; each change is written.

    `made_with` is what all rows of a file have in common.
    """

    file: Path
    made_with: Mapping[str, Any]
    known: Mapping[str, Row]
    figures: dict[str, list[dict[str, Any]]] = field(default_factory=dict)
    reasons: dict[str, str] = field(default_factory=dict)
    done: list[str] = field(default_factory=list)

    @classmethod
    def opened(cls, file: Path, made_with: Mapping[str, Any], known: Mapping[str, Row]) -> Ledger:
        """The ledger of a file, empty if there is none.

        Raises
        ------
        UserError
            If the file cannot be written, is something else, or has rows that were made with something else.
        """
        check_place(file)
        if not file.exists():
            return cls(file, made_with, known)
        said = parse_json(read_bytes(file, MOST_BYTES), file)
        hint = "name another file with -o"
        if not isinstance(said, dict) or said.get(BENCH) != NAME:
            raise UserError("is not of this bench", file=file, hint=hint)
        before = said.get(MADE_WITH)
        for name, value in made_with.items():
            if not isinstance(before, dict) or before.get(name) != value:
                got = before.get(name) if isinstance(before, dict) else before
                raise UserError(
                    "has rows of other conditions", file=file, field=name, got=got, expected=value, hint=hint
                )
        found = cls(file, made_with, known)
        try:
            for row in said[FIGURES]:
                if row["reason"] is None and row["row"] in known:
                    found.figures.setdefault(row["row"], []).append({key: row[key] for key in FIGURE})
            found.done = [name for name in known if name in said[DONE] and name in found.figures]
        except (KeyError, TypeError) as error:
            raise UserError("is damaged", file=file, field=FIGURES, hint=hint) from error
        return found

    def begin(self, name: str) -> None:
        """Forget what a row had, which is measured again."""
        self.figures.pop(name, None)
        self.reasons.pop(name, None)

    def add(self, name: str, figure: Mapping[str, Any]) -> None:
        self.figures.setdefault(name, []).append(dict(figure))
        self._write()

    def end(self, name: str, reason: str | None = None) -> None:
        """A row has all its figures, or the reason why not."""
        if reason is None:
            self.done.append(name)
        else:
            self.reasons[name] = reason
        self._write()

    def rows(self) -> list[dict[str, Any]]:
        """One row per figure, and one per reason."""
        found = []
        for name, row in self.known.items():
            for figure in self.figures.get(name, []):
                other = row.published.get(figure["name"])
                beside = {"published": other and other.figure, "on": other and other.machine}
                found.append({"row": name, **figure, **beside, "reason": None})
            if name in self.reasons:
                nothing = dict.fromkeys((*FIGURE, "published", "on"))
                found.append({"row": name, **nothing, "reason": self.reasons[name]})
        return found

    def _write(self) -> None:
        said = {BENCH: NAME, MADE_WITH: self.made_with, DONE: self.done, FIGURES: self.rows()}
        write_text(self.file, json.dumps(said, indent=1) + "\n")
