"""Progress in a notebook: one line in the cell, however often it is told."""

from __future__ import annotations

import nbformat
import pytest

from tests.api.executed import ROOT, run

WORK = """
from types import SimpleNamespace
from lambent.api import progress
ticks = iter(range(1000))
progress.time = SimpleNamespace(monotonic=lambda: next(ticks) / 10)  # ten reports a second
with progress.progress_of(None) as bar:
    for step in ("first", "second"):
        for done in range({reports}):
            bar(done, {reports}, step)
"""
FAILS = """
try:
    with progress.progress_of(None) as bar:
        for done in range(20):
            bar(done, 20, "third")
        raise ValueError
except ValueError:
    pass
"""


@pytest.mark.long
def test_a_cell_has_one_line():
    cells = [WORK.format(reports=100), WORK.format(reports=1), FAILS]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(one) for one in cells])
    run(notebook, ROOT)
    long, short, failed = ([o.data["text/plain"] for o in cell.outputs] for cell in notebook.cells)
    (line,) = long
    assert line.endswith(" s") and 20 < float(line[:-2]) < 60 and short == []
    assert len(failed) == 1 and failed[0].startswith("stopped after ")
