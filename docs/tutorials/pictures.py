"""Makes the pictures of the tutorials from their files, by what the tutorials say.

.venv/bin/python docs/tutorials/pictures.py lighting office.store      # as baked in the tutorial
.venv/bin/python docs/tutorials/pictures.py material
.venv/bin/python docs/tutorials/pictures.py look room.store            # needs Xvfb, xdotool and xprop
.venv/bin/python docs/tutorials/pictures.py research
"""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

import lambent

HERE = Path(__file__).parent
SAMPLES, POT = 6, (437, 428)  # at rest; where the second camera sees the teapot
PICTURES = HERE.parent / "pictures"
sys.path.insert(0, str(HERE.parents[1]))  # for the driver of windows, which the tests have


def lighting(store: Path) -> None:
    """The contact sheet."""
    with TemporaryDirectory() as folder:
        lambent.open(store).sheet(Path(folder) / "sheet.png")
        save("tutorial-lighting.jpg", read(Path(folder) / "sheet.png"), 1300)


def material() -> None:
    """Plane of incidence of table and two lobes."""
    with TemporaryDirectory() as folder:
        fit = lambent.read(HERE / "files/anodised.csv").fit(lobes=2)
        save("tutorial-material.jpg", read(next(p for p in fit.plots(folder) if "in_plane" in p.name)), 1400)


def look(store: Path) -> None:
    """The window with the copper's highlight pulled, at rest."""
    from tests.viewer.window_session import VirtualScreen, WindowSession

    with TemporaryDirectory() as folder:
        shutil.copytree(store, room := Path(folder) / "room.store")
        for name in ("session.json", "views.json"):
            (room / name).unlink(missing_ok=True)
        screen = VirtualScreen((1280, 800))
        out = Path(folder) / "out"
        out.mkdir()
        window = WindowSession(screen, room, out, (1280, 800), settings={"size": "measure", "card_seen": True})
        try:
            window.tool("key", "2")  # the camera that sees the table
            window.settle()
            window.click(*POT)
            window.click(*window.point("Curves"))
            window.settle()
            left, _, _, top, _ = window.state()["rects"]["tool"]
            window.drag((left + 140, top + 72), (left + 140, top + 38))  # the node at 20 degrees
            window.wait_for(lambda state: state["edited"])
            window.wait_for(lambda state: int((re.findall(r"(\d+) sample", state["at_rest"]) or [0])[0]) >= SAMPLES)
            window.settle()
            save("tutorial-look.jpg", screen.picture(), 1280)
        finally:
            window.kill()
            screen.close()


def research() -> None:
    """In motion, at rest, path traced, and FLIP."""
    fit = lambent.read(HERE / "files/anodised.csv").fit(lobes=2)
    with TemporaryDirectory() as folder:
        store = lambent.bake("builtin:box", Path(folder) / "box.store")
        how: dict = {"size": (320, 240), "edits": {"metal": fit.material}}
        motion = store.render("front", integrator="rings", samples=7, **how)
        still = store.render("front", **how)
        truth = store.render("front", integrator="path", samples=256, **how)
        for picture in (motion, still):
            print(lambent.compare(truth, picture))
        difference = np.uint8(255 * np.clip(lambent.compare(truth, motion).difference, 0, 1))
        row = [motion.shown, still.shown, truth.shown, difference]
        save("tutorial-research.jpg", np.concatenate(row, axis=1), 1280)


def read(file: Path) -> np.ndarray:
    return np.asarray(Image.open(file).convert("RGB"))


def save(name: str, picture: np.ndarray, width: int) -> None:
    image = Image.fromarray(picture)
    image = image.resize((width, round(image.height * width / image.width)), Image.Resampling.LANCZOS)
    image.save(PICTURES / name, quality=85, optimize=True)


if __name__ == "__main__":
    {"lighting": lighting, "material": material, "look": look, "research": research}[sys.argv[1]](
        *map(Path, sys.argv[2:])
    )
