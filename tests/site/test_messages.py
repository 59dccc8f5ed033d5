"""What a visitor reads where the room cannot be shown, in Chromium, Firefox and WebKit; a picture of it is there."""

from __future__ import annotations

import shutil

import pytest

from lambent.site.export import POSTER
from tests.site.conftest import served
from tests.site.other_browsers import firefox, webkit

PLAIN = ("--no-sandbox",)  # no software adapter
NAMED = "Chrome, Edge or Safari of 2025 or later"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "host", "words"),
    [
        ("delete Navigator.prototype.gpu", "127.0.0.1", NAMED),
        ("", "127.0.0.1", "finds no graphics adapter"),
        ("", "rooms.example", "from https or localhost only"),
    ],
    ids=["no WebGPU", "no adapter", "no https"],
)
def test_where_webgpu_is_missing(chromium, box_site, script, host, words):
    flags = (*PLAIN, "--host-resolver-rules=MAP rooms.example 127.0.0.1")
    with chromium(flags=flags) as page, served(box_site, "0.0.0.0") as address:
        page.add_init_script(script)
        page.goto(address.replace("0.0.0.0", host))
        page.wait_for_selector(f"#message:has-text('{words}')")
        assert page.is_visible("#poster") and not page.is_visible("#share")


@pytest.mark.long
def test_where_scripts_do_not_run(chromium, box_site, tmp_path):
    """Opened from the disk; without JavaScript; with a module missing."""
    with chromium(flags=PLAIN) as page:
        page.goto((box_site / "index.html").as_uri())
        page.wait_for_selector("#message:has-text('lambent serve FOLDER')")
        assert page.is_visible("#poster")
    with chromium(flags=PLAIN, java_script_enabled=False) as page, served(box_site) as address:
        page.goto(address)
        assert page.inner_text("#message") == "To walk here, turn on JavaScript." and page.is_visible("#poster")
    missing = shutil.copytree(box_site, tmp_path / "missing")
    (missing / "frame.js").unlink()
    with chromium(flags=PLAIN) as page, served(missing) as address:
        page.goto(address)
        page.wait_for_selector("#message:has-text('scripts cannot be fetched')")


@pytest.mark.long
@pytest.mark.parametrize("browser", [firefox, webkit])
def test_other_browsers_without_webgpu(browser, box_site, tmp_path):
    with browser(tmp_path) as ask, served(box_site) as address:
        message, width_px, is_visible = ask(address, "WebGPU")
    assert NAMED in message and width_px == POSTER[0] and is_visible
