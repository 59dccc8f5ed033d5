"""Firefox and WebKit, driven by what they bring themselves: Marionette and WebDriver."""

from __future__ import annotations

import json
import os
import re
import shutil
import socket
import subprocess
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from tests.viewer.window_session import VirtualScreen

WAIT_S = 60
# Once the message of a page has these words and its picture is there: the message, and how wide the picture is.
FOUND = """const [words, done] = arguments, message = document.getElementById("message");
const look = () => message.textContent.includes(words) && poster.decode().then(
  () => done([message.textContent, poster.naturalWidth, poster.checkVisibility()]));
new MutationObserver(look).observe(message, { childList: true, characterData: true, subtree: true });
look();"""
Ask = Callable[[str, str], list[Any]]  # address, words of the message: FOUND


@contextmanager
def firefox(folder: Path) -> Iterator[Ask]:
    """Firefox without a window; `folder` is for its profile."""
    program = shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        pytest.skip("there is no Firefox to open the site in")
    (folder / "user.js").write_text('user_pref("marionette.port", 0);\n')
    command = [program, "--headless", "--no-remote", "--marionette", "--profile", str(folder)]
    with _ended(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        ports = (re.search(r"Listening on port (\d+)", line) for line in process.stdout)
        port = next(int(port[1]) for port in ports if port)
        with socket.create_connection(("127.0.0.1", port), WAIT_S) as connection, connection.makefile("rb") as stream:
            _message(stream)  # a greeting

            def do(name: str, **parameters: Any) -> Any:
                text = json.dumps([0, 1, f"WebDriver:{name}", parameters]).encode()
                connection.sendall(b"%d:%s" % (len(text), text))
                _, _, error, result = _message(stream)
                assert error is None, error
                return result

            def ask(address: str, words: str) -> list[Any]:
                do("Navigate", url=address)
                return list(do("ExecuteAsyncScript", script=FOUND, args=[words])["value"])

            do("NewSession")
            yield ask


def _message(stream: Any) -> Any:
    """The next message of Marionette: a length, a colon, JSON."""
    length = b""
    while (digit := stream.read(1)) != b":":
        length += digit
    return json.loads(stream.read(int(length)))


@contextmanager
def webkit(folder: Path) -> Iterator[Ask]:
    """WebKitGTK's small browser on a display of its own; `folder` is its home."""
    browser = next(Path("/usr/lib").glob("*/webkit2gtk-4.*/MiniBrowser"), None)
    if browser is None or not shutil.which("WebKitWebDriver") or not shutil.which("Xvfb"):
        pytest.skip("there is no WebKitWebDriver with MiniBrowser and Xvfb to open the site in")
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]

    def do(path: str, method: str = "POST", **body: Any) -> Any:
        address, data = f"http://127.0.0.1:{port}/session{path}", json.dumps(body).encode()
        with urllib.request.urlopen(urllib.request.Request(address, data, method=method), timeout=WAIT_S) as answer:
            return json.load(answer)["value"]

    def ask(address: str, words: str) -> list[Any]:
        do(f"{session}/url", url=address)
        return list(do(f"{session}/execute/async", script=FOUND, args=[words]))

    options = {"webkitgtk:browserOptions": {"binary": str(browser), "args": ["--automation"]}}
    with ExitStack() as stack:
        screen = VirtualScreen()
        stack.callback(screen.close)
        environment = {**os.environ, "DISPLAY": screen.name, "HOME": str(folder)}
        driver = stack.enter_context(_ended(["WebKitWebDriver", f"--port={port}"], env=environment))
        while driver.poll() is None:  # until it listens
            with suppress(ConnectionError), socket.create_connection(("127.0.0.1", port)):
                break
        session = f"/{do('', capabilities={'alwaysMatch': options})['sessionId']}"
        stack.callback(do, session, "DELETE")
        yield ask


@contextmanager
def _ended(command: list[str], **options: Any) -> Iterator[Any]:
    """A process that ends with the block."""
    with subprocess.Popen(command, **options) as process:
        try:
            yield process
        finally:
            process.terminate()
