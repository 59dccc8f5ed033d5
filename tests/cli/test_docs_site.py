"""The documentation as a site: every page, every public name, every command, every key of a scene."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import lambent
from lambent.scenes.loaders.scene_toml.schema import SceneDocument

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Built strictly: a broken link, a missing anchor or a page that no other names fails."""
    folder = tmp_path_factory.mktemp("built") / "site"
    command = [sys.executable, "-m", "mkdocs", "build", "-d", str(folder)]
    quiet = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=quiet)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.slow
def test_the_site_has_the_reference_of_all_that_is_public(site):
    python = (site / "reference/python/index.html").read_text("utf-8")
    assert not [name for name in lambent.__all__[1:] if f".{name}" not in python]
    assert "tables.Table.fit" in python and "Parameters" in python
    commands = (site / "reference/commands/index.html").read_text("utf-8")
    assert all(f'id="{name}"' in commands for name in ("bake", "fit", "inspect", "relight", "walk"))
    scene = (site / "reference/scene-toml/index.html").read_text("utf-8")
    schema = SceneDocument.model_json_schema()
    sections = [schema, *schema["$defs"].values()]
    keys = {key for section in sections for key in section.get("properties", {})}
    assert len(keys) > 60 and not [key for key in keys if f"<code>{key}</code>" not in scene]


@pytest.mark.slow
def test_the_readme_is_the_home_page(site):
    home = (site / "index.html").read_text("utf-8")
    assert "Two commands" in home and "pictures/room.jpg" in home and 'href="scenes/"' in home


@pytest.mark.slow
def test_every_command_has_a_manual(site):
    manuals = {page.stem: page.read_text("utf-8") for page in (site.parent / "man/man1").iterdir()}
    assert {"lambent-bake", "lambent-fit", "lambent-walk"} <= set(manuals)
    assert "\\-\\-quality" in manuals["lambent-bake"]
    requests = {line.split()[0] for text in manuals.values() for line in text.splitlines() if line.startswith(".")}
    assert requests == {".TH", ".SH", ".nf", ".fi"}


@pytest.mark.slow
def test_the_files_that_tutorials_begin_with_can_be_saved(site):
    for page in (site / "tutorials").glob("*/index.html"):
        for file in re.findall(r'href="\.\./(files/[^"]+)"', page.read_text("utf-8")):
            assert (site / "tutorials" / file).stat().st_size > 100
    assert len(list((site / "tutorials/files").iterdir())) == 3
