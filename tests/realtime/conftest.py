"""One device for all tests of the renderer."""

from __future__ import annotations

from typing import Any

import pytest

from lambent.realtime.gpu.device import open_device


@pytest.fixture(scope="session")
def device(adapter: None) -> Any:
    return open_device()
