"""Runs command lines in this process and captures what they print."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import pytest

from lambent.cli.main import run


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        return json.loads(self.out)


@pytest.fixture
def lambent(capfd: pytest.CaptureFixture[str]) -> Callable[..., Outcome]:
    """`lambent("fit", path, ...)` gives the exit code, stdout and stderr."""

    def call(*arguments: object) -> Outcome:
        capfd.readouterr()
        code = run([str(argument) for argument in arguments])
        return Outcome(code, *capfd.readouterr())

    return call


@pytest.fixture
def refused(lambent: Callable[..., Outcome]) -> Callable[..., str]:
    """Runs a command line that must be refused: code 2, nothing on stdout, a line on stderr after steps, warnings."""

    def call(*arguments: object) -> str:
        outcome = lambent(*arguments)
        assert (outcome.code, outcome.out) == (2, ""), outcome
        *steps, error = outcome.err.splitlines(keepends=True)
        assert error.startswith("lambent: error: ") and error.endswith("\n"), outcome.err
        assert all(step.startswith("warning: ") or step.endswith(" s\n") for step in steps), outcome.err
        return error

    return call
