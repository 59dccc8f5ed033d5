"""Pages of the site from the notebooks, which have no outputs: text, code, and small pictures of what they show.

.venv/bin/python docs/notebook_pages.py     # executes the notebooks and makes the pictures anew
"""

from __future__ import annotations

import base64
import io
import json
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

NOTEBOOKS = Path(__file__).parent / "notebooks"
NOTE = "Executed by the tests. [Download this notebook]({name}.ipynb)"
WIDEST_PX, QUALITY = 900, 80


def on_files(files: Files, config: Any) -> Files:
    """Add a page for each notebook; the notebook itself is a file to download."""
    for file in sorted(NOTEBOOKS.glob("*.ipynb")):
        page = f"notebooks/{file.stem}.md"
        files.append(File.generated(config, page, content="\n\n".join(page_of(file)) + "\n"))
    return files


def page_of(file: Path) -> Iterator[str]:
    """The cells as Markdown, a picture below each that has one, and the way to the file below the title."""
    for number, cell in enumerate(json.loads(file.read_text("utf-8"))["cells"]):
        text = "".join(cell["source"])
        if cell["cell_type"] == "code":
            yield f"```python\n{text}\n```"
            if picture_of(file, number).exists():
                yield f"![Output](pictures/{picture_of(file, number).name})"
        else:
            yield text
        if number == 0:
            yield NOTE.format(name=file.stem)


def picture_of(file: Path, number: int) -> Path:
    return NOTEBOOKS / "pictures" / f"{file.stem}-{number}.jpg"


def main(names: list[str]) -> None:
    """Execute the notebooks of these names, by default all, and keep the last picture of each cell."""
    import nbformat
    from nbclient import NotebookClient

    for file in (NOTEBOOKS / f"{name}.ipynb" for name in names) if names else sorted(NOTEBOOKS.glob("*.ipynb")):
        notebook = nbformat.read(file, 4)
        with tempfile.TemporaryDirectory() as folder:
            NotebookClient(notebook, timeout=None, resources={"metadata": {"path": folder}}).execute()
        for number, cell in enumerate(notebook.cells):
            shown = [o.data for o in cell.get("outputs", []) if "data" in o]
            pictures = [data[kind] for data in shown for kind in ("image/png", "image/jpeg") if kind in data]
            if pictures:
                keep(base64.b64decode(pictures[-1]), picture_of(file, number))


def keep(picture: bytes, file: Path) -> None:
    """Write a picture as a small JPEG."""
    from PIL import Image

    image = Image.open(io.BytesIO(picture)).convert("RGB")
    image.thumbnail((WIDEST_PX, WIDEST_PX))
    file.parent.mkdir(exist_ok=True)
    image.save(file, quality=QUALITY, optimize=True)


if __name__ == "__main__":
    main(sys.argv[1:])
