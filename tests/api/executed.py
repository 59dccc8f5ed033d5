"""Notebooks executed in a kernel of their own, without a browser."""

from __future__ import annotations

from pathlib import Path

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).parents[2]
TIMEOUT_S = 120  # of a cell that hangs


def executed(*cells, folder=ROOT):
    """What each cell shows last, by MIME type; empty for a cell that shows nothing."""
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(one) for one in cells])
    run(notebook, folder)
    results = [[o.data for o in cell.outputs if o.output_type == "execute_result"] for cell in notebook.cells]
    return [found[-1] if found else {} for found in results]


def run(notebook, folder):
    """Execute a notebook in a folder; its first error is raised."""
    client = NotebookClient(
        notebook, timeout=TIMEOUT_S, kernel_name="python3", resources={"metadata": {"path": folder}}
    )
    client.execute()
