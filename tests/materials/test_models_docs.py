"""The example in docs/adding-a-model.md is the model of that name, and its shader agrees with it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials import models as package
from lambent.materials.models import model_named
from tests.tools.shader_parity import assert_parity, run_wgsl

PAGE = Path(__file__).parents[2] / "docs" / "adding-a-model.md"


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)


@pytest.fixture
def phong():
    return model_named("phong")


@pytest.mark.parametrize("language", ["python", "wgsl"])
def test_the_example_is_the_file_itself(language):
    """The tests of all models test that file."""
    file = Path(package.__path__[0]) / {"python": "phong.py", "wgsl": "phong.wgsl"}[language]
    assert blocks(language)[0] == file.read_text(encoding="utf-8")


def test_the_shader_agrees(phong):
    rng = np.random.default_rng(0)
    z, phi = rng.uniform(-1, 1, (2, 5000)), rng.uniform(0, 2 * np.pi, (2, 5000))
    wi, wo = direction(np.arccos(z), phi).astype(np.float32)
    expected = phong(ks=1.0, exponent=8.0).eval(wi.astype(float), wo.astype(float))[:, 0]
    got = run_wgsl(phong.shader(), "lambent_phong(wi, wo, 8.0)", {"wi": wi, "wo": wo})
    assert_parity(got, expected, rtol=1e-5, atol=1e-6 * expected.max())


def test_the_snippet_that_uses_it_runs(phong, capsys):
    exec(compile(blocks("python")[1], str(PAGE), "exec"), {})
    assert capsys.readouterr().out == "True\n"
