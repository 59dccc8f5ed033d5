"""A mode is a folder, found and opened: a toy one of a single panel and a drawing of one colour."""

import time

import pytest
from PIL import ImageGrab

from lambent.core.errors import UserError
from lambent.viewer import app, edit, modes
from tests.viewer.window_session import VirtualScreen, WindowSession, missing_tools

TOY = '''
from lambent.viewer.mode import Drawing, Mode, Panel

STARTS = ("toy",)
NO_DISPLAY = "play outside"


def edits(path):
    return path.suffix == ".toy"


def start(path, name, screen, **options):
    import numpy as np
    import wgpu
    from imgui_bundle import imgui

    from lambent.realtime.gpu.device import open_device
    from lambent.viewer.input import Input

    class Plain(Drawing):
        """One colour."""

        views = ()

        def update(self, place, pixel_ratio):
            """It is always drawn."""

        @property
        def images(self):
            return {"picture A": COLOUR}

    def draw():
        if imgui.button("wind up"):
            screen.say(f"{path.stem} goes")

    COLOUR = np.full((4, 4, 4), (30, 160, 90, 255), np.uint8)
    panel = Panel("Toy", draw, "a toy", opened=True)
    return Mode(path.stem, screen, Input(screen, None, None), Plain(open_device()), [panel])
'''


ALARM = TOY.replace('STARTS = ("toy",)', 'STARTS = ("alarm",)').replace('".toy"', '".alarm"')
ALARM = (
    ALARM[: ALARM.index("    def draw():")]
    + """
    shown = []

    def draw():
        if screen.messages:
            shown.append(None)
        imgui.button(f"shown {len(shown)}")

    class Alarm(Mode):
        at_s = screen.clock() + 4.0

        def advance(self, dt_s):
            if screen.clock() >= self.at_s:
                self.at_s = float("inf")
                screen.say("it rings")

        def wait_s(self):
            return max(0.0, self.at_s - screen.clock()) if self.at_s < float("inf") else None

    COLOUR = np.full((4, 4, 4), (30, 160, 90, 255), np.uint8)
    panel = Panel("Alarm", draw, "an alarm", opened=True)
    return Alarm(path.stem, screen, Input(screen, None, None), Plain(open_device()), [panel])
"""
)


@pytest.fixture
def toys(tmp_path, monkeypatch):
    """A folder of modes with one more."""
    (tmp_path / "modes" / "toy").mkdir(parents=True)
    (tmp_path / "modes" / "toy" / "__init__.py").write_text(TOY)
    monkeypatch.setattr(modes, "__path__", [*modes.__path__, str(tmp_path / "modes")])
    return tmp_path / "modes"


def test_modes_are_found(toys, tmp_path):
    assert list(app.starts()) == ["edit", "material", "toy", "walk", "view"]
    assert edit.editing_mode(tmp_path / "train.toy") == "toy"
    assert edit.editing_mode(tmp_path / "brass.json") == edit.editing_mode(tmp_path / "missing.bsdf") == "material"
    with pytest.raises(UserError, match=r"unknown mode.*toy"):
        app.run(tmp_path, "toi")


@pytest.mark.slow
def test_a_message_from_the_background_settles(adapter, toys, tmp_path):
    """Dear ImGui finds the size of what is new one frame later: without another frame, a message is cut off."""
    if missing_tools():
        pytest.skip(f"not installed: {', '.join(missing_tools())}")
    (toys / "alarm").mkdir()
    (toys / "alarm" / "__init__.py").write_text(ALARM)
    screen = VirtualScreen()
    session = WindowSession(screen, tmp_path / "clock.alarm", tmp_path, (480, 320), f"found:{toys}")
    try:
        session.wait_for(lambda state: "shown 1" in state["rects"])
        end = time.monotonic() + 3
        while "shown 3" not in session.state()["rects"]:
            assert time.monotonic() < end, "the window sleeps too soon"
            time.sleep(0.05)
    finally:
        session.kill()
        screen.close()


@pytest.mark.slow
def test_a_toy_mode_opens_answers_and_closes(adapter, toys, tmp_path):
    if missing_tools():
        pytest.skip(f"not installed: {', '.join(missing_tools())}")
    screen = VirtualScreen()
    session = WindowSession(screen, tmp_path / "train.toy", tmp_path, (480, 320), f"found:{toys}")
    try:
        title = session.tool("getwindowname", session.id)
        assert ImageGrab.grab(xdisplay=screen.name).getpixel((40, 40)) == (30, 160, 90)
        session.click(*session.point("wind up"))
        session.wait_for(lambda state: state["messages"] == ["train goes"])
        session.tool("key", "h")
        session.wait_for(lambda state: state["picture"] == [480, 320])
        assert title.strip() == "Lambent: train" and session.close() == 0, session.log()
    finally:
        session.kill()
        screen.close()
