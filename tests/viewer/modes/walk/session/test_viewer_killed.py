"""`kill -9` loses at most five seconds of edits, and leaves a session that can be read."""

import pytest

from tests.viewer.killed_window import losses
from tests.viewer.window_session import missing_tools

TRIES, MOST_S = 2, 5.0  # `python -m tests.viewer.killed_window 20` tries more


@pytest.mark.long
def test_a_killed_window_loses_five_seconds_of_edits_at_most(adapter, tmp_path):
    if missing_tools():
        pytest.skip(f"not installed: {', '.join(missing_tools())}")
    assert max(losses(TRIES, tmp_path)) <= MOST_S
