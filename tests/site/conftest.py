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
from lambent.materials.document import Lobe, Material
from lambent.site import export, manifest
from lambent.site.serving import SiteServer
from lambent.store.kept.session import FILE, RoomState, WalkSession, write_session

PAGE = Path(export.__file__).parent / "page"
STILLS_PAGE = PAGE.with_name("stills_page")
FLAGS = (
    "--no-sandbox",
    "--enable-unsafe-webgpu",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
    "--use-angle=swiftshader",
)
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
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("there is no Chromium to open the site in")
    with api.sync_playwright() as driver:

        @contextmanager
        def opened(flags=FLAGS, **options):
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
