"""The whole editor on a virtual screen, with a real mouse and real keys."""

import pytest

from lambent.materials.document import load_material
from tests.viewer.editor.measured_specimens import BRASS, write_measurement
from tests.viewer.window_session import WindowSession

pytestmark = pytest.mark.slow
SIZE = (900, 700)


@pytest.fixture(scope="module")
def session(virtual_screen, tmp_path_factory):
    folder = tmp_path_factory.mktemp("editor")
    BRASS.save(folder / "brass.json")
    write_measurement(folder / "brass.txt", BRASS)
    session = WindowSession(virtual_screen, folder / "brass.txt", folder, SIZE, f"edit:{folder / 'brass.json'}")
    yield session
    session.kill()


def lobe_of(state):
    return state["edited"].get("brass", {"lobes": [{}]})["lobes"][0]


@pytest.mark.long
def test_drag_undo_and_orbit(session):
    start = session.wait_for(lambda state: state["editor"]["exact"])
    session.drag(session.point("mx", 0.5), session.point("mx", 0.75))
    moved = session.wait_for(lambda state: lobe_of(state).get("mx", 0) > 0.2 and state["editor"]["exact"])
    assert moved["editor"]["error"] > start["editor"]["error"]
    assert moved["camera"] == start["camera"]
    session.tool("key", "ctrl+z")
    back = session.wait_for(lambda state: state["edited"] == {} and state["editor"]["exact"])
    assert back["editor"]["error"] == pytest.approx(start["editor"]["error"])
    session.drag((60, 200), (120, 220))
    turned = session.wait_for(lambda state: state["camera"] != start["camera"])
    assert turned["camera"]["target"] == start["camera"]["target"]
    session.click(60, 60)
    assert session.state()["camera"] == turned["camera"], "a click is no drag"


@pytest.mark.long
def test_a_long_path_is_typed_and_said_to_be_wrong(session):
    session.click(*session.point("##open", 0.5))
    session.tool("type", "/a/long/path/to/no/measurement.bsdf")
    session.wait_for(lambda state: state["editor"]["typed"].get("open", "").endswith("bsdf"))
    session.tool("key", "Return")
    session.wait_for(lambda state: any("not loaded" in m and "cannot be read" in m for m in state["messages"]))
    assert session.state()["editor"]["measured"]


@pytest.mark.long
def test_the_borders_move_and_the_window_resizes(session):
    before = session.state()["picture"]
    x, y = before[0] + 3, before[1] / 2
    session.drag((x, y), (x - 80, y))
    narrower = session.wait_for(lambda state: state["picture"][0] < before[0] - 40)
    session.tool("windowsize", session.id, 1100, 760)
    session.wait_for(lambda state: state["picture"][0] > narrower["picture"][0] and state["picture"][1] > before[1])


@pytest.mark.long
def test_save_and_close(session):
    """Last, because it closes the window of the tests before."""
    session.drag(session.point("mx", 0.5), session.point("mx", 0.3))
    session.wait_for(lambda state: lobe_of(state).get("mx", 1) < 0.15)
    session.tool("key", "ctrl+s")
    session.wait_for(lambda state: any(m.startswith("saved") for m in state["messages"]))
    saved = load_material(session.out / "brass.json")
    assert saved.lobes[0].mx < 0.15 and "edited by hand" in saved.provenance.notes[-1]
    session.drag(session.point("mx", 0.3), session.point("mx", 0.6))
    session.wait_for(lambda state: lobe_of(state).get("mx", 0) > saved.lobes[0].mx)
    assert session.close("discard") == 0
    assert "changes not saved: brass" in session.log()
