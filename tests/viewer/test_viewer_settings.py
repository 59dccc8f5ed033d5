"""What the window remembers of its user survives later versions, damage and read-only folders."""

import json
import os

import pytest

from lambent.core.errors import UserError
from lambent.viewer.screen import Screen
from lambent.viewer.settings import MOST_BYTES, Settings, read_settings, settings_file


def test_the_file_lies_in_the_users_configuration(monkeypatch, tmp_path):
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "own"))
    assert settings_file() == tmp_path / "own" / "lambent" / "window.json"
    monkeypatch.setenv("XDG_CONFIG_HOME", "relative")
    assert settings_file() == tmp_path / ".config" / "lambent" / "window.json", "as the specification says"
    monkeypatch.setattr("sys.platform", "win32")
    monkeypatch.delenv("APPDATA", raising=False)
    assert settings_file() is None


def test_a_change_is_there_for_the_next_window(tmp_path):
    file = tmp_path / "new folder" / "window.json"
    screen = Screen()
    screen.remembered.open(file)
    assert screen.size == "design"
    screen.next_size()
    screen.remembered.set(scale=1.5)
    later = Screen().remembered
    later.open(file)
    assert (later.now.size, later.now.scale) == ("measure", 1.5) and not screen.messages


def test_keys_of_a_later_version_stay(tmp_path):
    file = tmp_path / "window.json"
    file.write_text(json.dumps({"size": "show", "halo": [1, 2]}))
    remembered = Screen().remembered
    remembered.open(file)
    remembered.set(card_seen=True)
    assert json.loads(file.read_text()) == {"size": "show", "scale": 1.0, "card_seen": True, "halo": [1, 2]}


@pytest.mark.parametrize(
    "text", ["{", "[]", '{"size": "huge"}', '{"scale": 1e9}', '{"scale": NaN}', " " * (MOST_BYTES + 1), "\udcff"]
)
def test_a_damaged_file_is_said_and_the_window_opens(tmp_path, text):
    file = tmp_path / "window.json"
    file.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(UserError, match=r"window\.json"):
        read_settings(file)
    screen = Screen()
    screen.remembered.open(file)
    assert screen.remembered.now == Settings() and "as the first time" in screen.messages[0].text
    screen.remembered.set(size="show")
    assert read_settings(file).size == "show" and len(screen.messages) == 1


@pytest.mark.skipif(os.name == "nt", reason="folders are not read-only there")
def test_settings_that_cannot_be_kept_are_said_once_and_count(tmp_path):
    (tmp_path / "file").write_text("in the way of a folder")
    screen = Screen()
    screen.remembered.open(tmp_path / "file" / "window.json")
    screen.remembered.set(size="show")
    (message,) = screen.messages
    assert screen.size == "show" and "not remembered" in message.text
