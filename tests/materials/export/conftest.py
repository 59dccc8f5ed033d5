"""Fixtures of the tests of writers."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from lambent.materials.export import gltf, matching


@pytest.fixture(autouse=True, scope="module")
def few_pairs() -> Iterator[None]:
    """Fit other tools' models to an eighth of the pairs; the errors are still those at all pairs of the check."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (gltf, matching):
            patch.setattr(module, "FIT_LOG2", 9)
        yield
