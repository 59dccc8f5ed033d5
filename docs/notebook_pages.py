"""Pages of the site from the notebooks, which have no outputs: text, code, and what they show, kept in `shown/`.

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
    """The cells as Markdown, what each shows below it, and the way to the file below the title."""
    for number, cell in enumerate(json.loads(file.read_text("utf-8"))["cells"]):
        source = "".join(cell["source"])
        if cell["cell_type"] != "code":
            yield source
        else:
            yield f"```python\n{source}\n```"
            text, picture = (shown_of(file, number, ending) for ending in ("txt", "jpg"))
            if text.exists():
                yield f"```text\n{text.read_text('utf-8')}```"
            if picture.exists():
                yield f"![Output](shown/{picture.name})"
        if number == 0:
            yield NOTE.format(name=file.stem)


def shown_of(file: Path, number: int, ending: str) -> Path:
    """What the cell of this number shows: text (txt) or a picture (jpg)."""
    return NOTEBOOKS / "shown" / f"{file.stem}-{number}.{ending}"


def main(names: list[str]) -> None:
    """Execute the notebooks of these names, by default all, and keep text and the last picture of each cell."""
    import nbformat
    from nbclient import NotebookClient

    for file in (NOTEBOOKS / f"{name}.ipynb" for name in names) if names else sorted(NOTEBOOKS.glob("*.ipynb")):
        notebook = nbformat.read(file, 4)
        with tempfile.TemporaryDirectory() as folder:
            NotebookClient(notebook, timeout=None, resources={"metadata": {"path": folder}}).execute()
        for number, cell in enumerate(notebook.cells):
            outputs = cell.get("outputs", [])
            pictures = [
                o.data[kind] for o in outputs for kind in ("image/png", "image/jpeg") if kind in o.get("data", {})
            ]
            if pictures:
                keep(base64.b64decode(pictures[-1]), shown_of(file, number, "jpg"))
            if text := "".join(said_by(outputs)):
                shown_of(file, number, "txt").write_text(text, "utf-8")


def said_by(outputs: list[Any]) -> Iterator[str]:
    """What is printed, and results without a picture."""
    for output in outputs:
        if output.output_type == "stream" and output.name == "stdout":
            yield output.text
        elif output.output_type == "execute_result" and not {"image/png", "image/jpeg"} & output.data.keys():
            yield output.data["text/plain"] + "\n"


def keep(picture: bytes, file: Path) -> None:
    """Write a picture as a small JPEG."""
    from PIL import Image

    image = Image.open(io.BytesIO(picture)).convert("RGB")
    image.thumbnail((WIDEST_PX, WIDEST_PX))
    file.parent.mkdir(exist_ok=True)
    image.save(file, quality=QUALITY, optimize=True)


if __name__ == "__main__":
    main(sys.argv[1:])
