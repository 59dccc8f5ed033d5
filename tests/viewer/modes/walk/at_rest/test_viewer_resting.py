"""The real window at rest: the tracing process wakes it, and nothing else has to."""

import os
import signal

import pytest

from tests.viewer.window_session import SKIP

pytestmark = pytest.mark.slow


@pytest.mark.long
def test_the_window_sleeps_until_a_picture_is_traced_and_learns_that_tracing_has_ended(
    baked_box, open_window, tmp_path
):
    session = open_window(baked_box, tmp_path)
    first = session.wait_for(lambda state: state["at_rest"].startswith("traced"))
    session.wait_for(lambda state: state["at_rest"] != first["at_rest"] and "noise" in state["at_rest"])
    session.tool("key", SKIP)
    session.wait_for(lambda state: state["skipped"] == 1)
    session.settle()
    os.kill(session.state()["tracing"], signal.SIGKILL)
    ended = session.wait_for(lambda state: any("tracing was killed" in text for text in state["messages"]))
    assert session.wait_for(lambda state: state["settled"])["drawn"] >= ended["drawn"] > 0
