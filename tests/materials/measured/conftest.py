"""Fixtures of the tests of measured tables."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lambent.materials.measured import load
from lambent.materials.measured.protocol import MeasuredTable
from tests.materials.measured.measured_files import Loaded
from tests.materials.measured.sound_files import seeds


@pytest.fixture(scope="session")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A sound small file per format; all with the same ending, because readers look at the content."""
    folder = tmp_path_factory.mktemp("measured")
    paths = {name.split()[0].lower(): contents[0] for name, contents in seeds().items()}
    for name, content in paths.items():
        (folder / f"{name}.bsdf").write_bytes(content)
    return {name: folder / f"{name}.bsdf" for name in paths}


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
