"""What README and docs tell a reader to type exists, options included."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
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
