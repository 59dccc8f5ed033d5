"""`store.view()` in a notebook's kernel, with and without a browser."""

from __future__ import annotations

import base64
import io
import sys

import numpy as np
import pytest
from PIL import Image

import lambent
from tests.api.executed import executed

OPEN = """
import lambent, numpy as np
from tests.api.front_end import FrontEnd
store = lambent.open({folder!r})
view = store.view(size=(160, 120))
end = FrontEnd(view)
first = await end.until(lambda: True)
"""


@pytest.fixture(scope="module")
def run(adapter, baked_box):
    """Executes cells after `OPEN`, and returns what the last one shows."""
    return lambda *cells: executed(OPEN.format(folder=str(baked_box)), *cells)[-1]


@pytest.mark.long
def test_without_a_browser_the_cell_has_a_picture(adapter, baked_box):
    (shown,) = executed(f"import lambent; lambent.open({str(baked_box)!r}).view('front', size=(96, 64))")
    assert "application/vnd.jupyter.widget-view+json" in shown
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(shown["image/jpeg"]))))
    assert picture.shape == (64, 96, 3) and picture.std() > 20
    assert shown["text/plain"] == "View('box', 'front')"


@pytest.mark.long
def test_a_drag_looks_keys_walk_the_wheel_steps(run):
    shown = run(
        """
eye = view.camera
await end.after(lambda: end.drag((80, 60), (90, 60), (120, 60)))
looked = view.camera
await end.after(lambda: (end.say("key_down", key="w"), end.say("key_up", key="w")))
walked = view.camera
await end.after(lambda: end.say("wheel", x=80, y=60, dx=0, dy=100))
(looked.position == eye.position, looked.target != eye.target, walked.position != eye.position,
 view.camera.position != walked.position)
"""
    )
    assert shown["text/plain"] == "(True, True, True, True)"


@pytest.mark.long
def test_controls_change_the_picture_and_keys_take_it_back(run):
    shown = run(
        """
controls, said = view._cell.controls, []
brighter = await end.after(lambda: setattr(controls._room[-1].widget, "value", view.exposure_ev + 2))
said.append(bool(brighter.mean() > first.mean() + 5))
things = view._state.selection
end.drag((80, 60))
await end.until(lambda: things.name is not None and controls._material)
colour = next(one for one in controls._material if one.widget.description == "colour")
red = await end.after(lambda: setattr(colour.widget, "value", "#ff0000"))
said.append(list(view.edits) == [things.material])
await end.after(lambda: end.say("key_down", key="z", modifiers=("Control",)))
said += [view.edits == {}, colour.widget.value != "#ff0000"]
said
"""
    )
    assert shown["text/plain"] == "[True, True, True, True]"


@pytest.mark.long
def test_it_converges_at_rest_and_the_picture_is_the_one_shown(run, mi):
    shown = run(
        """
await end.until(lambda: "sample" in view._state.screen.at_rest)
picture = view.picture
picture.radiance.shape, bool(abs(picture.shown.astype(int) - end.picture).mean() < 4)
"""
    )
    assert shown["text/plain"] == "((120, 160, 3), True)"


@pytest.mark.long
def test_two_views_and_closed_ones(run, mi):
    shown = run(
        """
other = store.view("front", exposure_ev=view.exposure_ev + 1, size=(96, 64))
there = FrontEnd(other, (96, 64))
await there.until(lambda: "sample" in other._state.screen.at_rest)
from pathlib import Path
children = lambda: sum((one.read_text().split() for one in Path("/proc/self/task").glob("*/children")), [])
before = len(children())
view.close(), view.close()
moved = await there.after(lambda: there.drag((40, 30), (60, 30)))
after = len(children())
other.close()
try:
    other.picture
except lambent.UserError as error:
    assert str(error) == "view: is closed; open another with `store.view()`"
else:
    raise AssertionError("a closed view has no picture")
repr(view), after < before, len(children()) < after, moved.std() > 0
"""
    )
    assert shown["text/plain"] == "(\"View('box', closed)\", True, True, np.True_)"


@pytest.mark.long
def test_without_an_adapter_it_says_so(baked_box):
    shown = executed(
        f"""
import lambent, lambent.realtime.gpu.device, wgpu
wgpu.gpu.enumerate_adapters_sync = lambda: []
try:
    lambent.open({str(baked_box)!r}).view()
except lambent.UserError as error:
    said = str(error)
said
"""
    )
    assert "no graphics adapter found; expected Vulkan" in shown[-1]["text/plain"]


def test_a_missing_extra_is_a_line(baked_box, monkeypatch):
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    monkeypatch.delitem(sys.modules, "lambent.viewer.canvas.cell", raising=False)
    with pytest.raises(
        lambent.UserError, match=r"ipywidgets: is not installed; run `pip install 'lambent\[notebook\]'`"
    ):
        lambent.open(baked_box).view()


def test_it_says_what_is_missing_in_a_line(adapter, baked_box):
    store = lambent.open(baked_box)
    with pytest.raises(lambent.UserError, match=r"view: needs the kernel of a notebook; use `lambent walk`"):
        store.view()
    for wrong, message in (
        ({"camera": "back"}, "unknown camera.*back"),
        ({"size": (0, 90)}, "size"),
        ({"exposure_ev": float("nan")}, "exposure"),
        ({"variant": "night"}, "unknown variant.*night"),
        ({"light": {"lmap": 1.0}}, "unknown light group.*lmap"),
        ({"edits": {"rde": store.materials["red"]}}, "unknown material.*rde"),
    ):
        with pytest.raises(lambent.UserError, match=message):
            store.view(**wrong)
