"""What README and docs tell a reader to type exists, options included; `test_docs_run` runs it. Links and words."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
RECORDS = sorted({*(ROOT / "docs/decisions").glob("*.md")} - {ROOT / "docs/decisions/README.md"})
WORDS, RECORD_WORDS, MOST_RECORDS = 31_500, 150, 40  # of all pages together, of a decision's record, and their number
COMMAND = re.compile(r"(?:^ *|`|lambent )lambent ([a-z]+)([^`\n]*)", re.MULTILINE)


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
    made = "reference/"  # by the site, which checks them
    assert not [link for link in links if made not in link and not (page.parent / link).exists()]


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
    """Markup of tables is none."""
    return sum(any(one.isalnum() for one in word) for word in page.read_text("utf-8").split())


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


@pytest.mark.long
def test_the_picture_of_the_packages_shows_their_imports():
    """If not: .venv/bin/python docs/data_flow.py"""
    spec = importlib.util.spec_from_file_location("data_flow", ROOT / "docs/data_flow.py")
    data_flow = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(data_flow)
    drawn = re.findall(r"<title>(\w+) to (\w+)</title>", data_flow.PICTURE.read_text("utf-8"))
    assert set(drawn) == data_flow.direct(data_flow.imports())
