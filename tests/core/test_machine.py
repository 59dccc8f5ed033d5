"""Facts of the machine, as far as any machine can be expected to agree."""

from __future__ import annotations

import pytest

from lambent.core import machine


@pytest.mark.parametrize("name", ["DISPLAY", "WAYLAND_DISPLAY"])
def test_a_display_is_named_by_the_environment(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.setattr(machine.sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert not machine.has_display()
    monkeypatch.setenv(name, ":0")
    assert machine.has_display()


def test_systems_with_one_desktop_have_a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine.sys, "platform", "darwin")
    monkeypatch.delenv("DISPLAY", raising=False)
    assert machine.has_display()
