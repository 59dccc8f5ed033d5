"""How the page loads a site in Chromium: a first picture, then the exact one; and files that do not arrive."""

from __future__ import annotations

import base64
import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from tests.site.conftest import served
from tests.site.test_export import manifest_of

SIZE = 96, 64
PIXELS = """async ([width, height]) => {
  const { readManifest, Data } = await import("/loading.js");
  const { Frame } = await import("/frame.js"), { openDevice } = await import("/device.js");
  const manifest = await readManifest(), device = await openDevice(manifest), faults = [];
  device.addEventListener("uncapturederror", (event) => faults.push(event.error.message));
  const said = (bytes) => btoa(String.fromCharCode(...bytes));
  const data = new Data(() => {}), read = data.read.bind(data);
  let first, release;
  const gate = new Promise((resolve) => (release = resolve));
  data.read = async (piece) => (piece.standin && (await gate), read(piece));
  const frame = await Frame.open(manifest, device, document.createElement("canvas"), data, 0, async (frame) => {
    if (first) return;
    frame.resize(width, height);
    first = frame.pixels(manifest.cameras[0]);
    await first;
    release();
  });
  const last = await frame.pixels(manifest.cameras[0]);
  return { faults, first: said(await first), last: said(last), coarse: frame.objects.coarse.size,
    kept: data.files.size };
}"""


@pytest.mark.long
def test_the_first_picture_is_coarse_and_the_last_exact(chromium, box_site, streamed_site):
    found = {}
    for site in (box_site, streamed_site):
        with chromium(bypass_csp=True) as page, served(site) as address:
            page.goto(f"{address}site.css")
            answer = page.evaluate(PIXELS, SIZE)
            assert answer["faults"] == [] and answer["coarse"] == 0 and answer["kept"] == 0
            found[site] = [
                np.frombuffer(base64.b64decode(answer[which]), np.uint8).reshape(SIZE[1], SIZE[0], 4).astype(float)
                for which in ("first", "last")
            ]
    (whole, same), (coarse, exact) = found[box_site], found[streamed_site]
    assert whole.std() > 10 and np.array_equal(whole, same), "nothing of it is large"
    assert np.array_equal(exact, same), "the stand-ins leave no trace"
    assert 0.01 < np.abs(coarse - exact).mean() < 6, "and the first picture is nearly that"


@pytest.mark.long
def test_a_file_that_fails_after_the_first_picture_is_tried_again(chromium, streamed_site):
    manifest = manifest_of(streamed_site)
    large = [manifest["tables"]["texture"][at]["data"] for at in manifest["states"][0]["finer"]]
    missing, damaged = large[0]["file"], large[1]["file"]
    fails = {missing: lambda route: route.abort(), damaged: lambda route: route.fulfill(body=b"other bytes")}
    waiting, faults, asked = [], [], Counter()

    def answer(route):
        name = f"data/{route.request.url.rsplit('/', 1)[1]}"
        asked[name] += 1
        if waiting is not None and name in fails:
            waiting.append(route)  # until the first picture is there
        else:
            fails.pop(name, type(route).continue_)(route)

    with chromium() as page, served(streamed_site) as address:
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.route("**/data/*", answer)
        page.goto(address)
        page.wait_for_selector("body[data-frames]", state="attached")
        assert page.inner_text("#message") == "" and not page.is_visible("#poster")
        assert " MB" in page.inner_text("#rest") and not page.is_visible("#again")
        held, waiting = waiting, None
        words = {missing: "cannot be fetched", damaged: "is damaged; export the site again"}
        for route in sorted(held, key=lambda route: missing not in route.request.url):
            name = f"data/{route.request.url.rsplit('/', 1)[1]}"
            fails.pop(name)(route)
            page.wait_for_selector(f"#message:has-text('{name} {words[name]}')")
            assert page.is_visible("#picture") and not page.is_visible("#poster")
            page.click("#again")
            page.wait_for_selector("#message:empty", state="attached")
        page.wait_for_selector("#rest:empty", state="attached")
        assert faults == [] and fails == {} and len(held) == 2
        assert {name for name, count in asked.items() if count > 1} == {missing, damaged}, "all else came once"


HEAP_GROWTH, MEMORY_GROWTH = 0.5e6, 60e6  # bytes: of JavaScript, and of all processes, over all reloads
RELOADS, SWITCHES, FIRST = 50, 20, 10  # caches of code and shaders fill during the first reloads


def _memory(page) -> tuple[float, float]:
    """Bytes that live in JavaScript after a collection, and of the browser's processes."""
    client = page.context.new_cdp_session(page)
    client.send("HeapProfiler.collectGarbage")
    usage = client.send("Runtime.getHeapUsage")
    client.detach()
    processes = page.context.browser.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]
    pages = sum(int(Path(f"/proc/{one['id']}/statm").read_text().split()[1]) for one in processes)
    return usage["usedSize"] + usage["backingStorageSize"], pages * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.long
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="this system has no /proc to read memory from")
def test_reloads_and_states_leave_nothing_behind(chromium, streamed_site):
    with chromium() as page, served(streamed_site) as address:
        page.set_viewport_size({"width": 200, "height": 120})

        def whole():
            page.wait_for_selector("body[data-frames]", state="attached")
            page.wait_for_selector("#rest:empty", state="attached")

        def switch(name):
            page.click(f"#states button >> text={name}")
            page.wait_for_selector(f"body[data-state='{name}']", state="attached")

        page.goto(address)
        for _ in range(FIRST):
            whole()
            page.reload()
        whole()
        before = _memory(page)
        for _ in range(RELOADS - FIRST):
            page.reload()
            whole()
        after = _memory(page)
        assert after[0] - before[0] < HEAP_GROWTH and after[1] - before[1] < MEMORY_GROWTH, (before, after)
        for _ in range(2):
            switch("blue")
            switch("as baked")
        before = _memory(page)
        for _ in range(SWITCHES // 2):
            switch("blue")
            switch("as baked")
        after = _memory(page)
        assert after[0] - before[0] < HEAP_GROWTH and after[1] - before[1] < MEMORY_GROWTH, (before, after)
