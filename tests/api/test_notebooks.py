"""The notebooks of the documentation: short, without outputs in git, from the public API alone, and they run."""

from __future__ import annotations

import ast
import json

import nbformat
import pytest

from tests.api.executed import ROOT, run

NOTEBOOKS = sorted((ROOT / "docs/notebooks").glob("*.ipynb"))
NAMES = {"measurement", "blind", "evenings", "curves", "light-fields", "tables"}
LIBRARIES = {"lambent", "numpy", "matplotlib"}
MOST_CELLS = 10


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where all of them run, so that one bakes the store of another."""
    return tmp_path_factory.mktemp("notebooks")


def test_all_notebooks_are_here():
    assert {file.stem for file in NOTEBOOKS} == NAMES
    site = (ROOT / "mkdocs.yml").read_text("utf-8")
    assert all(f"notebooks/{name}.md" in site for name in NAMES)


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_is_short_and_has_no_outputs(file):
    notebook = json.loads(file.read_text("utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(cells) <= MOST_CELLS
    kept = [cell["id"] for cell in cells if cell["outputs"] or cell["execution_count"] is not None]
    assert not kept, f"strip the outputs: jupyter nbconvert --clear-output --inplace {file.name}"
    assert "widgets" not in notebook["metadata"]


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_uses_what_is_public(file):
    cells = [cell for cell in nbformat.read(file, 4).cells if cell.cell_type == "code"]
    nodes = [node for cell in cells for node in ast.walk(ast.parse(cell.source))]
    imported = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    imported += [str(node.module) for node in nodes if isinstance(node, ast.ImportFrom)]
    assert {name.partition(".")[0] for name in imported} <= LIBRARIES
    assert not [name for name in imported if name.startswith("lambent.")]
    private = [node.attr for node in nodes if isinstance(node, ast.Attribute) and node.attr.startswith("_")]
    assert "lambent" in imported and not private


@pytest.mark.long
@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_runs(file, folder, adapter, mi):
    notebook = nbformat.read(file, 4)
    run(notebook, folder)
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert any("image/png" in output.get("data", {}) for output in shown)
    assert not [output.text for output in shown if output.output_type == "stream" and output.name == "stderr"]
