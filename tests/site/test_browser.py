"""The page in headless Chromium: the same pictures as the native renderer, a visit, and what goes wrong."""

from __future__ import annotations

import json
import shutil

import pytest

from tests.site.conftest import served


@pytest.mark.slow
def test_a_visit(chromium, box_site):
    """Look by dragging, walk by keys, go to a view, share, resize."""
    with chromium() as page, served(box_site) as address:
        faults = []
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.goto(address)
        page.wait_for_selector("body[data-frames]", state="attached")
        assert page.title() == "box" and page.inner_text("#message") == "" and not page.is_visible("#poster")
        first = page.get_attribute("body", "data-camera")
        page.mouse.move(150, 80)
        page.mouse.down()
        page.mouse.move(180, 86, steps=3)
        page.mouse.up()
        page.wait_for_selector(f"body:not([data-camera='{first}'])", state="attached")
        turned = page.get_attribute("body", "data-camera")
        assert turned.split(",")[:3] == first.split(",")[:3], "looking does not move the eye"
        page.keyboard.down("w")
        page.wait_for_selector(f"body:not([data-camera='{turned}'])", state="attached")
        page.keyboard.up("w")
        page.click("#views button >> text=front")
        page.wait_for_selector(f"body[data-camera='{first}']", state="attached")
        page.click("#states button >> text=blue")
        page.wait_for_selector("body[data-state='blue']", state="attached")
        assert page.get_attribute("#states button >> text=blue", "aria-pressed") == "true"
        page.click("#share")
        assert page.url == f"{address}#{first}&state=blue"
        frames = int(page.get_attribute("body", "data-frames"))
        page.set_viewport_size({"width": 200, "height": 300})
        page.wait_for_selector(f"body:not([data-frames='{frames}'])", state="attached")
        assert page.get_attribute("#picture", "width") == "200"
        where = turned.replace(turned.split(",")[0], "0.25", 1)
        page.goto(f"{address}#{where}")
        page.wait_for_selector(f"body[data-camera='{where}']", state="attached")
        assert faults == []


@pytest.mark.long
def test_a_lost_device_comes_back(chromium, box_site):
    with chromium() as page, served(box_site) as address:
        page.goto(address)
        page.wait_for_selector("body[data-frames]", state="attached")
        frames = page.get_attribute("body", "data-frames")
        page.context.browser.new_browser_cdp_session().send("Browser.crashGpuProcess")
        page.wait_for_selector(f"body:not([data-frames='{frames}'])", state="attached")
        page.wait_for_selector("#message:empty", state="attached")


@pytest.mark.long
def test_a_damaged_or_missing_file_is_said(chromium, box_site, tmp_path):
    damaged = shutil.copytree(box_site, tmp_path / "damaged")
    manifest = json.loads((box_site / "manifest.json").read_text())
    first = manifest["tables"]["texture"][: manifest["states"][0]["counts"]["texture"]]
    name = max((one["data"] for one in first if "data" in one), key=lambda piece: piece["packed"])["file"]
    largest = damaged / name
    content = bytearray(largest.read_bytes())
    content[len(content) // 2] ^= 255
    largest.write_bytes(content)
    missing = shutil.copytree(box_site, tmp_path / "missing")
    (missing / name).unlink()
    for folder, words in ((damaged, "is damaged; export the site again"), (missing, "cannot be fetched (404")):
        with chromium() as page, served(folder) as address:
            page.goto(address)
            page.wait_for_selector(f"#message:has-text('{words}')")
            assert page.is_visible("#poster")
