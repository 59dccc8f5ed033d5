"""Every command and every piece of Python in README and docs is run, page by page, or says why it is not.

Lines run as they are written, in a folder of small files under the names that the pages use. What "draft", "preview"
and "normal" mean is coarse here, illuminances take few samples, and pictures in reports are small. Windows, which wait
for a person, are not opened: their own tests do that.
"""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import tomllib
from functools import partial
from pathlib import Path

import pytest

from lambent.baking import bake as baking
from lambent.baking.quality import quality_named
from lambent.scenes.loaders.scene_toml.schema import SceneDocument
from tests.cli.documented import Block, blocks_of, merged
from tests.cli.readers_folder import COARSE, bake_store, furnish

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
SHOWN = {"text", "wgsl", "json"}  # languages of blocks that nobody types
SHELL = {"cp", "cat", "mkdir", "python"}
PLACEHOLDER = re.compile(r"\b(SCENE|STORE|MEASUREMENT|MATERIAL\.json)\b")  # of a line that shows a form
WINDOWS = {"walk", "view", "edit", "relight"}


@pytest.fixture(scope="module")
def reader(tmp_path_factory: pytest.TempPathFactory, mi: None, adapter: None) -> Path:
    folder = tmp_path_factory.mktemp("reader")
    furnish(folder)
    bake_store(folder)
    return folder


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> list[object]:
    """Bakes, illuminances and the previews of reports are coarse, and windows are listed instead of opened."""
    from lambent.baking.pictures import irradiance
    from lambent.baking.reference import material_preview
    from lambent.viewer import app, edit

    opened: list[object] = []
    for module in (app, edit):
        monkeypatch.setattr(module, "run", lambda *what, **options: opened.append(what[0]))
    monkeypatch.setattr(
        baking, "quality_named", lambda name: COARSE if name in ("draft", "preview", "normal") else quality_named(name)
    )
    small = partial(material_preview.preview, size_px=32, spp=8)
    monkeypatch.setattr(material_preview, "preview", small)
    monkeypatch.setattr(irradiance, "MOST", 64)
    return opened


def run_of(page: Path) -> list[Block]:
    return [block for block in blocks_of(page) if block.note != "not run" and block.language not in SHOWN]


@pytest.mark.long
@pytest.mark.parametrize("page", [page for page in PAGES if run_of(page)], ids=lambda page: page.stem)
def test_what_the_page_says_works(page, reader, coarse, lambent, tmp_path, monkeypatch):
    folder = tmp_path / "folder"
    shutil.copytree(reader, folder)
    monkeypatch.chdir(folder)
    made = set().union(*(block.outputs for block in run_of(page)))
    for name in made & {path.name for path in folder.iterdir()}:
        shutil.rmtree(name) if Path(name).is_dir() else Path(name).unlink()
    names: dict[str, object] = {"__name__": "page"}
    for block in run_of(page):
        where = f"{page.name}:{block.line}"
        if block.note == "into":
            file = Path(block.about)
            before = file.read_text("utf-8") if file.exists() else ""
            file.write_text(merged(block.text, before) if before else block.text, "utf-8")
        elif block.language == "python":
            exec(compile(block.text, where, "exec"), names)
        elif block.language == "toml":
            scene = {"format": "lambent-scene", "version": 1, "geometry": "builtin:box"}
            SceneDocument.model_validate({**scene, **tomllib.loads(block.text)})
        else:
            type_in(block, where, lambent, coarse)


def type_in(block: Block, where: str, lambent, opened: list[object]) -> None:
    for line in block.commands:
        program, *words = shlex.split(line)
        if program == "lambent":
            before = len(opened)
            outcome = lambent(*words)
            assert outcome.code == 0, f"{where}: {line}\n{outcome.err}"
            assert len(opened) - before == (words[0] in WINDOWS and "-o" not in words), f"{where}: {line}"
        else:
            assert program in SHELL, f"{where}: {line}"
            subprocess.run([program, *words], check=True)
    assert not [file for file in block.outputs if not written(file)], where


def written(file: str) -> bool:
    """A `#` stands for digits of a sequence."""
    return any(Path().glob(re.sub("#+", "*", file)))


def test_every_block_is_of_a_known_kind():
    kinds = SHOWN | {"sh", "python", "toml"}
    unknown = [(page.name, b.line) for page in PAGES for b in blocks_of(page) if b.language not in kinds]
    assert not unknown
    commands = [block for page in PAGES for block in run_of(page) if block.language == "sh"]
    assert len(commands) > 40 and all(block.commands for block in commands)


def test_what_is_not_run_has_a_reason():
    notes = [(page.name, b.line, b.about) for page in PAGES for b in blocks_of(page) if b.note == "not run"]
    assert notes and not [note for note in notes if len(note[2].split()) < 2]
    shown = [(page.name, b.line, b.text) for page in PAGES for b in blocks_of(page) if b.language == "text"]
    typed = [block for block in shown if block[2].startswith("lambent ")]
    assert not [block for block in typed if not PLACEHOLDER.search(block[2])]
