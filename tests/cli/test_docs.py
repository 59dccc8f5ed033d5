"""What README and docs tell a reader to type exists, options included; the README's five minutes run in their order."""

from __future__ import annotations

import importlib.util
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

from lambent.baking import bake as baking
from lambent.baking.quality import quality_named
from lambent.demo.flow import DRAFT, SPECIMEN_OF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
RECORDS = sorted({*(ROOT / "docs/decisions").glob("*.md")} - {ROOT / "docs/decisions/README.md"})
WORDS, RECORD_WORDS, MOST_RECORDS = 35_000, 150, 40  # of all pages together, of a decision's record, and their number
COMMAND = re.compile(r"(?:^ {4,}|`|lambent )lambent ([a-z]+)([^`\n]*)", re.MULTILINE)


def typed() -> list[tuple[str, str, str]]:
    return [(page.name, name, rest) for page in PAGES for name, rest in COMMAND.findall(page.read_text("utf-8"))]


@pytest.mark.parametrize(("page", "name", "rest"), typed())
def test_command_and_options_exist(lambent, page, name, rest):
    outcome = lambent(name, "--help")
    assert outcome.code == 0, f"{page}: lambent {name}"
    missing = [option for option in re.findall(r"(?<![\w-])(--?[a-z][\w-]*)", rest) if option not in outcome.out]
    assert not missing, f"{page}: lambent {name}{rest}"


def test_the_readme_is_covered():
    assert {"fit", "bake", "walk", "render", "compare"} <= {name for page, name, _ in typed() if page == "README.md"}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\((?!https?://)([^)#]+)", page.read_text("utf-8"))
    assert not [link for link in links if not (page.parent / link).exists()]


def anchors(page: Path) -> set[str]:
    """GitHub's anchors of a page's headings."""
    headings = re.findall(
        r"^#+ (.+)$", re.sub(r"```.*?```", "", page.read_text("utf-8"), flags=re.DOTALL), re.MULTILINE
    )
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_anchors_are_headings(page):
    links = re.findall(r"\]\((?!https?://)([^)#]*)#([^)]+)\)", page.read_text("utf-8"))
    assert not [f"{path}#{name}" for path, name in links if name not in anchors(page.parent / path if path else page)]


def words(page: Path) -> int:
    return len(page.read_text("utf-8").split())


def test_the_docs_stay_short():
    assert sum(map(words, PAGES)) <= WORDS


def test_decisions_are_short_records_that_the_index_lists():
    assert len(RECORDS) <= MOST_RECORDS
    assert not {record.name: words(record) for record in RECORDS if words(record) > RECORD_WORDS}
    index = (ROOT / "docs/decisions/README.md").read_text("utf-8")
    titles = {record.name: record.read_text("utf-8").splitlines()[0].removeprefix("# ") for record in RECORDS}
    assert {file: title for title, file in re.findall(r"^- \[(.+)\]\((.+)\)$", index, re.MULTILINE)} == titles


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_pages_name_exist(page):
    """In backticks, from the package or the root of the repository."""
    named = re.findall(r"`((?:\w+/)+[\w.-]*(?:\.py|\.wgsl|/))`", page.read_text("utf-8"))
    assert not [name for name in named if not any((root / name).exists() for root in (ROOT, ROOT / "lambent"))]


def test_the_picture_of_the_packages_shows_their_imports():
    """If not: .venv/bin/python docs/data_flow.py"""
    spec = importlib.util.spec_from_file_location("data_flow", ROOT / "docs/data_flow.py")
    data_flow = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(data_flow)
    drawn = re.findall(r"<title>(\w+) to (\w+)</title>", data_flow.PICTURE.read_text("utf-8"))
    assert set(drawn) == data_flow.direct(data_flow.imports())


MINUTES = (ROOT / "README.md").read_text("utf-8").split("## Your own result in five minutes")[1].split("\n## ")[0]
COMMANDS = re.findall(r"^ {7}lambent (.+)$", MINUTES, re.MULTILINE)
CHANGES = re.findall(r"^ {7}(\[materials\.\w+\])\n {7}(file = .+)$", MINUTES, re.MULTILINE)
COARSE = DRAFT.changed(
    "coarse",
    geometry={"texels": 64},
    light_map={"samples": (4, 4), "noise": 9.0, "max_depth": 3, "gather_samples": 8},
    environment={"texels": 32},
    probe={"texels": 16, "samples": 1},
)
SMALLER = {"1680x1050": "64x40", "256": "1"}  # sizes and samples; nothing else of a line changes


def test_every_kind_of_line_is_found():
    found = {line.split()[0] for line in COMMANDS}
    assert found >= {"inspect", "fit", "check", "edit", "convert", "bake", "walk", "render"}
    assert len(CHANGES) == 1 and "cp lambent/scenes/builtin/room.toml room.toml" in MINUTES


@pytest.mark.slow
def test_the_five_minutes(lambent, tmp_path, monkeypatch):
    from lambent.viewer import app, edit

    monkeypatch.chdir(tmp_path)
    opened = []
    monkeypatch.setattr(app, "run", lambda *what, **options: opened.append(what[0]))  # they wait for a person
    monkeypatch.setattr(edit, "run", lambda *what, **options: opened.append(what[0]))
    whole = baking.bake  # of what pictures need alone
    monkeypatch.setattr(
        baking, "bake", lambda *what, **how: whole(*what, **{**how, "only": ("light_map", "environment")})
    )
    monkeypatch.setattr(baking, "quality_named", lambda name: COARSE if name == "preview" else quality_named(name))
    measured = Path("out/demo/measured")
    measured.mkdir(parents=True)
    brushed = Material(name="brushed", kd=0.05, lobes=(Lobe(k=0.9, mx=0.1, my=0.3, r0=0.9, alpha=0.5),))
    setup = Setup((0.0, 30.0, 60.0), step_deg=15, fine_deg=5, noise=0, floor=0)
    for name in SPECIMEN_OF:
        write_gonio(measured / f"{name}.txt", synthesise(brushed, setup))
    shutil.copy(ROOT / "lambent/scenes/builtin/room.toml", "room.toml")
    room = Path("room.toml").read_text("utf-8")
    for table, line in CHANGES:
        room, found = re.subn(re.escape(table) + r"\n[^\[]*(?:\[\{.*\}\]\n)?", f"{table}\n{line}\n\n", room)
        assert found == 1
    Path("room.toml").write_text(room, "utf-8")
    for line in COMMANDS:
        words = [SMALLER.get(word, word) for word in shlex.split(line)]
        if ".mp4" in line:
            words += ["--size", "64x40", "--fps", "1"]
        outcome = lambent(*words)
        assert outcome.code == 0, f"{line}\n{outcome.err}"
        if words[0] in ("edit", "walk") and not words[1].startswith("builtin:"):
            assert Path(words[1]).exists()
    assert len(opened) == sum(line.split()[0] in ("edit", "walk") for line in COMMANDS)
    for line in COMMANDS:
        for output in re.findall(r"(?:-o|--report|--plot) (\S+)", line):
            assert Path(output).exists(), line
    python = MINUTES.split("From Python")[1].replace("(640, 360)", "(64, 36)")
    up = np.array([0.0, 0.0, 1.0])
    exec("\n".join(re.findall(r"^ {4}(.*)$", python, re.MULTILINE)), {"wi": up, "wo": up})
    assert Path("table.png").exists()
