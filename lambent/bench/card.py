"""`card`: all rows that wait for a graphics card, within 12 minutes, beside published figures.

Rows are one per figure: `value` in `unit` on `device`, and what was `published` of it, `on` which machine. Each is
measured in a process of its own and may take its share of the budget, and what rows before it have left of theirs. One
that fails, takes longer, or no longer fits has a `reason` instead. Figures are in the file as soon as they are
measured: a run with the same file, after Ctrl-C or worse, measures only the rows that are not done. What rows need is
baked in a folder beside the file, which the end of a run removes.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import lambent
from lambent.bench.card_rows.effort import BUDGET_S, FULL, QUICK, Effort
from lambent.bench.card_rows.found import rows as found_rows
from lambent.bench.card_rows.ledger import Ledger
from lambent.bench.card_rows.process import Failed, figures
from lambent.bench.card_rows.row import Absent, adapter_name, cuda_name
from lambent.core.machine import core_count, cpu_name
from lambent.core.progress import Progress, silent

__all__ = ["FULL", "NAME", "QUICK", "run"]

NAME = "card"
FILE = Path("card.json")


def run(effort: Effort, output: Path | None = None, progress: Progress = silent) -> dict[str, Any]:
    """Rows of this machine, those included that are done in the file `output`, card.json by default."""
    rows, file, began = found_rows(), output or FILE, time.monotonic()
    ledger, work = Ledger.opened(file, _made_with(effort), rows), file.with_name(f"{file.name}.baked")
    left = {name: row.limit_s * effort.budget_s / BUDGET_S for name, row in rows.items() if name not in ledger.done}
    work.mkdir(parents=True, exist_ok=True)
    for name in list(left):
        limit_s, rest_s = left.pop(name), effort.budget_s - (time.monotonic() - began)
        if rest_s < limit_s:
            ledger.end(name, f"left out: it may take {limit_s:.0f} s, and {rest_s:.0f} s are left")
            continue
        ledger.begin(name)
        reason = None
        try:
            for figure in figures(name, rows[name], effort, work, max(limit_s, rest_s - sum(left.values()))):
                if figure is not None:
                    ledger.add(name, figure)
                spent_s = time.monotonic() - began
                progress(spent_s, effort.budget_s, f"{name}; {effort.budget_s - spent_s:.0f} s left")
        except Failed as error:
            reason = str(error)
        ledger.end(name, reason)
    shutil.rmtree(work)
    summary = {"file": str(file), "seconds": round(time.monotonic() - began), "done": len(ledger.done), "of": len(rows)}
    return {"rows": ledger.rows(), "summary": summary}


def _made_with(effort: Effort) -> dict[str, Any]:
    """What rows of one file have in common."""
    return {
        "lambent": lambent.__version__,
        "cpu": f"{cpu_name()}, {core_count()} cores",
        "adapter": _or_reason(adapter_name),
        "cuda": _or_reason(cuda_name),
        "effort": repr(replace(effort, budget_s=BUDGET_S)),  # the budget changes no figure
    }


def _or_reason(name: Callable[[], str]) -> str:
    try:
        return name()
    except Absent as error:
        return str(error)
