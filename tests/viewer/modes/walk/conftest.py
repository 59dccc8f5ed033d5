"""A small baked room, and panels of the mode, unfolded."""

import pytest

from tests.viewer.panel_driver import PanelDriver, walk_mode


@pytest.fixture
def unfolded(monkeypatch, state, geometry):
    """Function that opens the panels of the mode with some headers unfolded, and those above them folded."""
    drivers = []

    def opened(*headers):
        drivers.append(PanelDriver(monkeypatch, walk_mode(state, geometry)))
        for header in ("Material", "View", "Scene", *headers):
            drivers[-1].click(header, 0.3)
        drivers[-1].frame(2)
        return drivers[-1]

    yield opened
    for driver in drivers:
        driver.close()
