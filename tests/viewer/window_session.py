"""A window in a process of its own on a virtual screen, driven by xdotool."""

import io
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import imageio_ffmpeg
import numpy as np
from PIL import Image

from tests.viewer.panel_driver import point_of

ROOT = Path(__file__).parents[2]
PATIENCE_S = 120.0  # software adapters on a busy machine
ASLEEP_S = 1.0  # without a frame
MEASURE = {"size": "measure", "card_seen": True}
MARK, INTERRUPT, SKIP, DROP = "F12", "F11", "F10", "F9"  # see watched_window


def missing_tools():
    return [tool for tool in ("Xvfb", "xdotool") if shutil.which(tool) is None]


class VirtualScreen:
    """An X server of its own; `dpi` is what the desktop says of its screen, 96 for one pixel by point."""

    def __init__(self, size=(1280, 1024), dpi=96):
        self._size, (read, write) = "x".join(map(str, size)), os.pipe()
        command = ["Xvfb", "-displayfd", str(write), "-screen", "0", f"{self._size}x24", "-nolisten", "tcp", "-noreset"]
        self._process = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as pipe:
            self.name = f":{pipe.readline().strip()}"
        if dpi != 96:
            said = ["xprop", "-root", "-f", "RESOURCE_MANAGER", "8s", "-set", "RESOURCE_MANAGER", f"Xft.dpi:\t{dpi}\n"]
            subprocess.run(said, env={**os.environ, "DISPLAY": self.name}, check=True)

    def picture(self):
        """All that the screen shows, (H, W, 3)."""
        command = [imageio_ffmpeg.get_ffmpeg_exe(), "-f", "x11grab", "-video_size", self._size, "-i", self.name]
        command += ["-frames:v", "1", "-f", "image2pipe", "-c:v", "png", "-"]
        grabbed = subprocess.run(command, capture_output=True, timeout=60, check=True).stdout
        return np.asarray(Image.open(io.BytesIO(grabbed)).convert("RGB"))

    def close(self):
        self._process.terminate()
        self._process.wait(10)


class WindowSession:
    """One run of `watched_window`. Positions are logical pixels of the window.

    The window remembers `settings`; by default it shows every number, and no card.
    """

    def __init__(self, screen, store, out, size=(640, 480), mode="walk", settings=MEASURE):
        self.out = out
        self.settings_file = out / "config" / "lambent" / "window.json"
        self.settings_file.parent.mkdir(parents=True, exist_ok=True)
        self.settings_file.write_text(json.dumps(settings))
        self._environment = {**os.environ, "DISPLAY": screen.name, "XDG_CONFIG_HOME": str(out / "config")}
        self._environment.pop("WAYLAND_DISPLAY", None)
        command = [sys.executable, "-m", "tests.viewer.watched_window", store, out, f"{size[0]}x{size[1]}", mode]
        self._log = (out / "log.txt").open("w")
        self.process = subprocess.Popen(
            [str(part) for part in command], cwd=ROOT, env=self._environment, stderr=self._log, stdout=self._log
        )
        self.wait_for(lambda state: state["frames"] >= 3)
        self.id = self.tool("search", "--onlyvisible", "--name", "^Lambent").split()[0]
        self.tool("windowfocus", "--sync", self.id)

    def log(self):
        return (self.out / "log.txt").read_text()

    def tool(self, *words):
        done = subprocess.run(
            ["xdotool", *map(str, words)],
            env=self._environment,
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
        )
        assert done.returncode == 0, f"xdotool {words}: {done.stderr} {self.log()}"
        return done.stdout

    def state(self):
        path = self.out / "state.json"
        return json.loads(path.read_text()) if path.exists() else {"frames": 0}

    def wait_for(self, condition):
        """The state as soon as it meets the condition."""
        end = time.monotonic() + PATIENCE_S
        while True:
            state = self.state()
            if condition(state):
                return state
            assert self.process.poll() is None, f"the window closed: {self.log()}"
            assert time.monotonic() < end, f"still {state}\n{self.log()}"
            time.sleep(0.05)

    def settle(self):
        """Let the window answer what was sent: a key that means nothing comes after it, and is waited for."""
        marks = self.state()["marks"]
        self.tool("key", MARK)
        self.wait_for(lambda state: state["marks"] > marks and state["settled"])

    def sleeps(self):
        """Wait until the window draws nothing for a while; the state then."""
        last = [-1, time.monotonic()]

        def asleep(state):
            if state["frames"] != last[0]:
                last[:] = state["frames"], time.monotonic()
            return time.monotonic() - last[1] > ASLEEP_S

        return self.wait_for(asleep)

    def drop(self, file, x, y):
        """Drop a file onto a place of the window."""
        (self.out / "dropped.txt").write_text(str(file))
        self.move(x, y)
        self.tool("key", DROP)
        self.settle()

    def move(self, x, y):
        self.tool("mousemove", "--window", self.id, round(x), round(y))
        self.settle()

    def drag(self, begin, end, button=1):
        self.move(*begin)
        self.tool("mousedown", button)
        self.settle()
        for share in (0.4, 0.7, 1.0):
            self.move(*(a + share * (b - a) for a, b in zip(begin, end, strict=True)))
        self.tool("mouseup", button)
        self.settle()

    def click(self, x, y):
        self.move(x, y)
        self.tool("mousedown", 1)
        self.settle()
        self.tool("mouseup", 1)
        self.settle()

    def hold(self, key, until):
        """Hold a key until the state meets a condition."""
        self.tool("keydown", key)
        try:
            self.wait_for(until)
        finally:
            self.tool("keyup", key)
        self.settle()

    def point(self, label, along=0.5):
        return point_of(self.state()["rects"][label], along)

    def close(self, answer=None):
        """Close the window as its own button does, and answer what is to become of changes; returns the exit code."""
        subprocess.run(
            [sys.executable, "-m", "tests.viewer.close_button", self.id], cwd=ROOT, env=self._environment, check=True
        )
        if answer is not None:
            self.wait_for(lambda state: f"{answer}##closing" in state["rects"])
            self.settle()
            self.move(*self.point(f"{answer}##closing"))
            self.tool("mousedown", 1)
            self.settle()
            self.tool("mouseup", 1)
        try:
            return self.process.wait(PATIENCE_S)
        except subprocess.TimeoutExpired:
            self.process.send_signal(signal.SIGUSR1)
            time.sleep(1)
            raise AssertionError(f"the window stays open: {self.state()}\n{self.log()}") from None

    def kill(self):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait(10)
        self._log.close()
