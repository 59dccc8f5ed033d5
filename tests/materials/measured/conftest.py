"""Fixtures of the tests of measured tables."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.materials.measured import load
from lambent.materials.measured.inspecting.synthetic import ISOTROPIC, synthesise
from lambent.materials.measured.parts.gonio_text import write_gonio
from lambent.materials.measured.protocol import MeasuredTable
from tests.materials.measured.measured_files import (
    GLOSSY,
    Loaded,
    cornell_rows,
    cornell_text,
    merl_bytes,
    rgl_fields,
    tensor_bytes,
)


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """One sound small file per format; all with the same ending, because readers look at the content."""
    folder = tmp_path_factory.mktemp("measured")
    coarse = replace(ISOTROPIC, step_deg=15, fine_deg=10, theta_i_deg=(0.0, 30.0, 60.0))
    paths = {name: folder / f"{name}.bsdf" for name in ("merl", "rgl", "cornell", "gonio")}
    paths["merl"].write_bytes(merl_bytes(np.full((6, 5, 4, 3), 0.25)))
    paths["rgl"].write_bytes(tensor_bytes(rgl_fields(np.zeros(1))))
    paths["cornell"].write_text(cornell_text(cornell_rows(), np.linspace(400, 700, 5)))
    write_gonio(paths["gonio"], synthesise(GLOSSY, coarse))
    return paths


@pytest.fixture
def loaded(tmp_path: Path) -> Loaded:
    """The table of a file of the given content."""

    def table(content: str | bytes, name: str = "a.bsdf") -> MeasuredTable:
        (tmp_path / name).write_bytes(content.encode() if isinstance(content, str) else content)
        return load(tmp_path / name)

    return table


@pytest.fixture
def hemisphere() -> Callable[..., np.ndarray]:
    """Random unit directions (n, 3) with theta up to `theta_max_deg`."""

    def directions(n: int, seed: int, theta_max_deg: float = 80) -> np.ndarray:
        u = np.random.default_rng(seed).random((n, 2))
        z = 1 - u[:, 0] * (1 - np.cos(np.radians(theta_max_deg)))
        r, phi = np.sqrt(1 - z * z), 2 * np.pi * u[:, 1]
        return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)

    return directions
