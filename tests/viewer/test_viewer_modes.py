"""A mode is a folder, found and opened: a toy one of a single panel and a drawing of one colour."""

import pytest
from PIL import ImageGrab

from lambent.core.errors import UserError
from lambent.viewer import app, edit, modes
from tests.viewer.window_session import INTERRUPT

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

    class Alarm(Mode):
        at_s, seen = float("inf"), 0

        def advance(self, dt_s):
            if screen.clock() >= self.at_s:
                self.at_s = float("inf")
                screen.say(f"{path.stem} rings")

        def wait_s(self):
            return max(0.0, self.at_s - screen.clock()) if self.at_s < float("inf") else None

    def draw():
        mode.seen += bool(screen.messages)
        if imgui.button("wind up"):
            mode.at_s = screen.clock() + 2.0
        imgui.button(f"seen {mode.seen}")

    COLOUR = np.full((4, 4, 4), (30, 160, 90, 255), np.uint8)
    panel = Panel("Toy", draw, "a toy", opened=True)
    mode = Alarm(path.stem, screen, Input(screen, None, None), Plain(open_device()), [panel])
    return mode
'''


@pytest.fixture
def toys(tmp_path, monkeypatch):
    """A folder of modes with one more."""
    (tmp_path / "modes" / "toy").mkdir(parents=True)
    (tmp_path / "modes" / "toy" / "__init__.py").write_text(TOY)
    monkeypatch.setattr(modes, "__path__", [*modes.__path__, str(tmp_path / "modes")])
    return tmp_path / "modes"


def test_modes_are_found(toys, tmp_path):
    assert list(app.starts()) == ["edit", "material", "relight", "toy", "walk", "view"]
    assert edit.editing_mode(tmp_path / "train.toy") == "toy"
    assert edit.editing_mode(tmp_path / "brass.json") == edit.editing_mode(tmp_path / "missing.bsdf") == "material"
    with pytest.raises(UserError, match=r"unknown mode.*toy"):
        app.run(tmp_path, "toi")


@pytest.mark.long
def test_a_toy_mode_opens_rings_and_closes_at_an_interrupt(virtual_screen, open_window, toys, tmp_path):
    """Dear ImGui finds the size of new text one frame later: without further frames, a message is cut off."""
    session = open_window(tmp_path / "train.toy", tmp_path, (480, 320), f"found:{toys}")
    title = session.tool("getwindowname", session.id)
    assert ImageGrab.grab(xdisplay=virtual_screen.name).getpixel((40, 40)) == (30, 160, 90)
    session.click(*session.point("wind up"))
    session.wait_for(lambda state: state["messages"] == ["train rings"])
    session.wait_for(lambda state: "seen 3" in state["rects"])
    session.tool("key", "h")
    session.wait_for(lambda state: state["picture"] == [480, 320])
    session.tool("key", INTERRUPT)  # within a frame, after which the window closes
    assert title.strip() == "Lambent: train" and session.process.wait(60) == 0, session.log()
    assert "Received signal Interrupt" in session.log()
