"""Editing in place on a virtual screen: a scene is baked beside the window, edited, saved, closed and opened again."""

import pytest

from lambent.core.pictures.images import read_image
from lambent.editing.session.session import Session
from lambent.store.store import Store
from tests.viewer.watched_window import FEW_LIGHTS

pytestmark = pytest.mark.slow
SIZE, PIXELS = (900, 900), 24
FIRST, LAST = FEW_LIGHTS


@pytest.fixture
def opened(open_window):
    def start(what, folder):
        (folder / "state.json").unlink(missing_ok=True)  # of a window before
        return open_window(what, folder, SIZE, f"place:{PIXELS}")

    return start


@pytest.mark.long
def test_a_scene_is_baked_edited_and_opened_again(opened, tmp_path):
    first = opened("builtin:teatray", tmp_path)
    assert first.state()["lights"] == 0 and first.state()["baking"], "the window is there at once"
    first.wait_for(lambda state: state["lights"] == FIRST)
    assert first.close() == 0, first.log()
    with Store.open(tmp_path / "teatray.edit.store") as store:
        store.set_document("written by", "the test")  # the bake has ended with its window
    session = opened("builtin:teatray", tmp_path)
    session.wait_for(lambda state: state["lights"] == LAST and state["baking"] is None and not state["busy"])
    before = session.state()
    assert before["picture"] == [600, 600] and before["brightness"] > 0.01 and not before["trouble"]
    x, y = 0.5 * 600, 150 + 0.55 * 600
    session.click(x, y)
    session.wait_for(lambda state: state["selected"] == "glaze" and (state["pointed"] or [0, 0])[1] == "glaze")
    pull(session, 0.6, 0.15)
    edited = session.wait_for(lambda state: state["edited"]["glaze"] and not state["busy"])
    assert edited["brightness"] > 1.02 * before["brightness"]
    session.tool("key", "ctrl+z")
    session.wait_for(lambda state: not state["edited"]["glaze"] and not state["busy"])
    assert session.state()["brightness"] == pytest.approx(before["brightness"], rel=1e-3)
    session.tool("key", "ctrl+shift+z")
    session.wait_for(lambda state: state["edited"]["glaze"] and not state["busy"])
    session.tool("key", "p")
    session.wait_for(lambda state: any("teatray-001.png" in text for text in state["messages"]))
    assert read_image(tmp_path / "teatray-001.exr").mean() == pytest.approx(edited["brightness"], rel=1e-2)
    session.tool("key", "ctrl+s")
    session.wait_for(lambda state: any("edits.json" in text for text in state["messages"]))
    fold(session, "Material", "Curves", "View")
    session.click(*session.point("Interreflections"))
    session.wait_for(lambda state: "glaze##edited" in state["rects"])
    session.click(*session.point("bake"))
    session.wait_for(lambda state: state["samples"] >= 64 and state["brightness"] > 1.02 * edited["brightness"])
    bounced = session.wait_for(lambda state: not state["busy"])
    assert 1.02 * edited["brightness"] < bounced["brightness"] < 3 * edited["brightness"]
    assert session.close() == 0, session.log()
    saved = Session.open(tmp_path / "teatray-001.edits.json")
    assert saved.material("glaze").now.lobes[0].distribution == "curve"

    again = opened(tmp_path / "teatray-001.edits.json", tmp_path)
    there = again.wait_for(lambda state: state["lights"] == LAST and state["samples"] >= 64 and not state["busy"])
    assert there["baking"] is None and there["edited"]["glaze"]
    assert there["brightness"] == pytest.approx(bounced["brightness"], rel=0.05), "with the noise of fewer samples"
    assert again.close() == 0, again.log()


def fold(session, *headers):
    """Fold panels, or unfold them; one that is unfolded has scrolled the column, so its head comes into sight first."""
    for header in headers:
        session.move(SIZE[0] - 8, 500)  # beside plots and lists, which have the wheel for themselves
        session.tool("click", "--repeat", 30, 4)
        session.settle()
        session.click(*session.point(header, 0.3))
    session.settle()


def pull(session, begin, end):
    """Pull a node in the tail of the curve, between shares of the plot's height."""
    rects = session.state()["rects"]
    top, bottom = rects["tool"][3] + 10, rects["smooth"][1] - 45
    x = 0.3 * rects["tool"][0] + 0.7 * rects["tool"][2]
    session.drag((x, top + begin * (bottom - top)), (x, top + end * (bottom - top)))
