"""Blocks of the documentation's pages: commands, Python, and files that readers write.

An indented block, and one fenced as `sh`, holds commands, one a line. Every other block is fenced with its language. A
comment on the line before says what else to do:

    <!-- not run: WHY -->      the block is only looked at
    <!-- into FILE -->         the block is what the reader writes into FILE: its TOML tables replace those of the file
    <!-- no block is run: WHY -->    of a whole page
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

PAGE = re.compile(r"^<!-- no block is run: (.+) -->$", re.MULTILINE)
NOTE = re.compile(r"\s*<!-- (not run|into):? (.+?) -->$")
FENCE = re.compile(r"( *)```(\S*)$")
COMMENT = re.compile(r"\s+# .*$|^# .*$")
OUTPUTS = re.compile(r"(?:-o|--report|--plot) (\S+)")


@dataclass(frozen=True)
class Block:
    """`language` is "sh" for commands; `note` is "", "not run" or "into", followed by `about`."""

    line: int
    language: str
    text: str
    note: str = ""
    about: str = ""

    @property
    def commands(self) -> list[str]:
        """Lines to type, without their comments."""
        lines = (COMMENT.sub("", line).strip() for line in self.text.splitlines())
        return [line for line in lines if line]

    @property
    def outputs(self) -> set[str]:
        """Files and stores that the commands write."""
        return {file for line in self.commands for file in OUTPUTS.findall(line) if self.language == "sh"}


def blocks_of(page: Path) -> list[Block]:
    """The blocks of a page in their order."""
    text = page.read_text("utf-8")
    none = PAGE.search(text)
    found = _blocks(text.splitlines())
    return [replace(block, note="not run", about=none[1]) for block in found] if none else list(found)


def _blocks(lines: list[str]) -> Iterator[Block]:
    at = 0
    while at < len(lines):
        fence = FENCE.match(lines[at])
        if not fence and not _begins_indented(lines, at):
            at += 1
            continue
        start = at + 1 if fence else at
        end = _end(lines, start, bool(fence))
        margin = len(fence[1]) if fence else len(lines[at]) - len(lines[at].lstrip())
        text = "".join(line[margin:] + "\n" for line in lines[start:end])
        yield Block(at + 1, fence[2] if fence else "sh", text, *_note(lines[:at]))
        at = end + 1 if fence else end


def _begins_indented(lines: list[str], at: int) -> bool:
    before = lines[at - 1].strip() if at else ""
    return lines[at].startswith("    ") and bool(lines[at].strip()) and (not before or before.startswith("#"))


def _end(lines: list[str], at: int, fenced: bool) -> int:
    inside = (lambda line: line.strip() != "```") if fenced else (lambda line: not line.strip() or line[:4] == "    ")
    while at < len(lines) and inside(lines[at]):
        at += 1
    return at


def _note(before: list[str]) -> tuple[str, ...]:
    """The note in the last line that is not empty."""
    last = next(filter(str.strip, reversed(before)), "")
    note = NOTE.match(last)
    return note.groups() if note else ()


def merged(toml: str, into: str) -> str:
    """`into` with the tables of `toml`: of the same name replaced, others added at the end."""
    for table in filter(str.strip, re.split(r"(?m)^(?=\[)", toml)):
        header = table.splitlines()[0]
        whole = re.compile(rf"(?m)^{re.escape(header)}\n(?:(?!\[)[^\n]*\n)*")
        if header.startswith("[[") or not whole.search(into):
            into += "\n" + table
        else:
            into = whole.sub(lambda _, new=table: new, into, count=1)
    return into
