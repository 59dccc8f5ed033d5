"""Every command of the README's five minutes runs, in its order, on files as the demo leaves them."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest

from lambent.bake import bake as baking
from lambent.bake.quality import quality_named
from lambent.demo.flow import DRAFT, SPECIMEN_OF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import Setup, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio

ROOT = Path(__file__).parents[2]
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
