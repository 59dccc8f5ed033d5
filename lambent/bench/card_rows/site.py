"""Rows of an exported site: frames that the page's own code encodes in Chromium, if there is one."""

from __future__ import annotations

import importlib
import shutil
import threading
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from lambent.bench.card_rows.baking import baked
from lambent.bench.card_rows.effort import Effort
from lambent.bench.card_rows.frames import TURN_PX
from lambent.bench.card_rows.row import Absent, Figure, Row
from lambent.site.export import export
from lambent.site.serving import SiteServer
from lambent.store.contract import scene_record

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
COMMON = ("--no-sandbox", "--enable-unsafe-webgpu", "--enable-features=Vulkan")
HARDWARE = (*COMMON, "--ignore-gpu-blocklist", "--use-angle=vulkan")
SOFTWARE = (*COMMON, "--use-vulkan=swiftshader", "--use-angle=swiftshader")  # the tests' and the docs', too
FRAMES = """async ([camera, sizes, rounds, turn]) => {
  const { readManifest, Data } = await import("/loading.js"), { look } = await import("/camera.js");
  const { Frame } = await import("/frame.js"), { openDevice } = await import("/device.js");
  const manifest = await readManifest(), device = await openDevice(manifest), { queue } = device, found = [];
  const frame = await Frame.open(manifest, device, document.createElement("canvas"), new Data(() => {}));
  for (const [width, height] of sizes) {
    frame.resize(width, height);
    const usage = GPUTextureUsage.RENDER_ATTACHMENT;
    const target = device.createTexture({ size: [width, height], format: "rgba8unorm", usage }), times = [];
    for (let k = 0; k <= rounds; k++) {
      const began = performance.now();
      frame.draw(look(camera, k * turn, 0), target, "moving");
      await queue.onSubmittedWorkDone();
      if (k) times.push(performance.now() - began);
    }
    target.destroy();
    found.push(times.sort((a, b) => a - b)[times.length >> 1]);
  }
  return found;
}"""
ADAPTER = """async () => {
  const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
  if (!adapter) return null;
  const { vendor, architecture, description } = adapter.info;
  return description || `${vendor} ${architecture}`;
}"""


def measure(effort: Effort, work: Path) -> Iterator[Figure]:
    driver, program = _browser()
    store = baked(effort, work)
    camera = asdict(scene_record(store).cameras[0])
    camera["fovYDeg"] = camera.pop("fov_y_deg")
    with TemporaryDirectory(dir=work) as folder:
        export(store, Path(folder) / "site")
        with SiteServer(Path(folder) / "site") as server, driver.sync_playwright() as browsers:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            page, adapter = _page(browsers, program, server.address)
            sizes = [list(size) for size in effort.sizes]
            for size, ms in zip(
                sizes, page.evaluate(FRAMES, [camera, sizes, effort.rounds, TURN_PX]), strict=True
            ):  # fmt: skip
                yield Figure("x".join(map(str, size)), 1e3 / ms, "frames/s", f"Chromium, {adapter}")
            server.shutdown()


def _browser() -> tuple[Any, str]:
    """The driver's module, and the browser's program; raises `Absent` if one is missing."""
    try:
        driver = importlib.import_module("playwright.sync_api")
    except ImportError as error:
        raise Absent("playwright is not installed: pip install playwright") from error
    if (program := browser_program()) is None:
        raise Absent(f"no browser: none of {', '.join(PROGRAMS)}")
    return driver, program


def browser_program() -> str | None:
    """Path of the first of PROGRAMS on this machine."""
    return next(filter(None, map(shutil.which, PROGRAMS)), None)


def _page(browsers: Any, program: str, address: str) -> tuple[Any, str]:
    """A page of the site with a WebGPU adapter, hardware if the browser finds one, and the adapter's name."""
    for flags in (HARDWARE, SOFTWARE):
        browser = browsers.chromium.launch(executable_path=program, args=list(flags))
        page = browser.new_page(bypass_csp=True)
        page.set_default_timeout(0)  # the row has a limit
        page.goto(f"{address}site.css")
        if adapter := page.evaluate(ADAPTER):
            return page, adapter
        browser.close()
    raise Absent("Chromium finds no WebGPU adapter")


ROWS = {"site in Chromium": Row(measure, 50, 10)}
