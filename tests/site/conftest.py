"""The page's modules in node, and a site of the box."""

from __future__ import annotations

import json
import shutil
import subprocess
import threading
from contextlib import contextmanager
from pathlib import Path

import pytest

import lambent
from lambent.baking.bake import bake
from lambent.bench.card_rows.site import SOFTWARE, browser_program
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box, patch, placed
from lambent.scenes.scene import Scene, SceneObject
from lambent.site import export, manifest
from lambent.site.serving import SiteServer
from lambent.store.kept.session import FILE, RoomState, WalkSession, write_session
from tests.baking.small_scenes import TINY, turned_inwards

PAGE = Path(export.__file__).parent / "page"
STILLS_PAGE = PAGE.with_name("stills_page")
VIEWPORT = {"width": 320, "height": 240}


@pytest.fixture
def javascript(tmp_path):
    """Runs JavaScript that ends with `say(VALUE)`, beside the page's modules; returns the value."""
    if shutil.which("node") is None:
        pytest.skip("there is no node to run the page's modules")
    for file in PAGE.glob("*.js"):
        shutil.copy(file, tmp_path)
    (tmp_path / "package.json").write_text('{"type": "module"}')

    def run(code: str, given: object = None):
        (tmp_path / "given.json").write_text(json.dumps(given))
        head = "import fs from 'node:fs'; const say = (one) => fs.writeFileSync('said.json', JSON.stringify(one));"
        (tmp_path / "run.js").write_text(f"{head}\nconst given = JSON.parse(fs.readFileSync('given.json'));\n{code}")
        done = subprocess.run(["node", "run.js"], capture_output=True, text=True, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return json.loads((tmp_path / "said.json").read_text())

    return run


@pytest.fixture(scope="session")
def blue_box(baked_box, tmp_path_factory):
    """A store of the box with a state in which its red wall is blue and light follows."""
    folder = shutil.copytree(baked_box, tmp_path_factory.mktemp("states") / "box.store")
    blue = Material(name="red", kd=(0.05, 0.1, 0.7), lobes=(Lobe(mx=0.1, my=0.1),))
    write_session(folder / FILE, WalkSession(states={"blue": RoomState(materials={"red": blue})}))
    return folder


@pytest.fixture(scope="session")
def box_site(adapter, blue_box, tmp_path_factory):
    folder = tmp_path_factory.mktemp("site") / "box"
    lambent.export(blue_box, folder)
    return folder


@pytest.fixture(scope="module")
def chromium():
    """Opens pages in Chromium with WebGPU on its software adapter."""
    api = pytest.importorskip("playwright.sync_api", reason="there is no playwright to drive a browser")
    if (program := browser_program()) is None:
        pytest.skip("there is no Chromium to open the site in")
    with api.sync_playwright() as driver:

        @contextmanager
        def opened(flags=SOFTWARE, **options):
            browser = driver.chromium.launch(executable_path=program, args=list(flags))
            try:
                page = browser.new_page(viewport=VIEWPORT, **options)
                page.set_default_timeout(180_000)
                yield page
            finally:
                browser.close()

        yield opened


@contextmanager
def served(folder, host="127.0.0.1"):
    with SiteServer(folder, host) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield server.address
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture(scope="session")
def streamed_site(adapter, blue_box, tmp_path_factory):
    """The box with stand-ins, as larger rooms have them."""
    folder = tmp_path_factory.mktemp("streamed") / "box"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(manifest, "LARGE", 1000)
        lambent.export(blue_box, folder)
    return folder


def hall() -> Scene:
    """A room with what depends on the camera: glossy floor, mirror with two sides, panes behind panes, thin bars."""
    glass = Material(lobes=(Lobe(mx=0.003, my=0.003, r0=0.04, k=(0.8, 0.95, 0.9), side="transmission"),))
    materials = {
        "paint": Material(kd=(0.6, 0.5, 0.4)), "glass": glass, "red": Material(kd=(0.7, 0.1, 0.1)),
        "lacquer": Material(kd=(0.05, 0.1, 0.2), lobes=(Lobe(mx=0.05, my=0.05, r0=0.2),)),
        "mirror": Material(lobes=(Lobe(mx=0.01, my=0.01, r0=0.9),)), "lamp": Material(),
    }  # fmt: skip
    walls = turned_inwards(placed(box((4, 2.5, 4)), (0, 1.25, 0)))
    bars = [
        SceneObject(f"bar {k}", placed(box((0.006, 1.2, 0.006)), (-1.2 + 0.08 * k, 0.9, -0.9)), "red")
        for k in range(12)
    ]
    panes = [
        SceneObject(f"pane {k}", patch((0.2 + 0.1 * k, 0.3, 0.4 + 0.35 * k), (0.9, 0, 0.2), (0, 1.1, 0)), "glass")
        for k in range(3)
    ]
    objects = (
        SceneObject("walls", walls, "paint"),
        SceneObject("floor", patch((-1.9, 0.01, 1.9), (3.8, 0, 0), (0, 0, -3.8)), "lacquer"),
        SceneObject("mirror", patch((-1.5, 0.4, 0.9), (0.5, 0, -0.9), (0, 1.4, 0)), "mirror"),
        SceneObject("lamp", patch((-0.5, 2.4, -0.5), (1, 0, 0), (0, 0, 1)), "lamp", emission=(6, 6, 5)),
        *bars, *panes,
    )  # fmt: skip
    return Scene("hall", objects, materials, cameras=(Camera("entrance", (0.5, 1.3, 1.8), (-0.2, 0.7, -0.6)),))


@pytest.fixture(scope="session")
def hall_store(mi, tmp_path_factory):
    folder = tmp_path_factory.mktemp("hall") / "hall.store"
    bake(hall(), folder, quality=TINY).close()
    return folder


@pytest.fixture(scope="session")
def hall_site(adapter, hall_store, tmp_path_factory):
    folder = tmp_path_factory.mktemp("site") / "hall"
    lambent.export(hall_store, folder)
    return folder
