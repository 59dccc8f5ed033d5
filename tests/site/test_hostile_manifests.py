"""Manifests that are not as they were exported: the page says so in a line, whatever they hold.

Their checksum betrays every change. Those with a true checksum and wrong content, which only an attacker makes, end
in a line too, where the browser or the graphics device refuse them.
"""

from __future__ import annotations

import base64
import re
from codecs import BOM_UTF8
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest

from lambent.site.export import manifest_text
from tests.reliability.mutations import mutate
from tests.site.conftest import served
from tests.site.test_export import manifest_of

DAMAGED = "manifest.json is damaged; export the site again"
OTHER = "manifest.json has version 2; this page reads version 1"
SAYS = "() => /^(?!Loading)./.test(message.textContent) && message.textContent"  # elements are known by their names
READ = """import { readManifest, SiteError } from "./loading.js";
const said = [];
for (const text of given) {
  globalThis.fetch = async () => new Response(Buffer.from(text, "base64"));
  await readManifest().then((found) => said.push(found.name), (error) => {
    if (!(error instanceof SiteError)) throw error;
    said.push(error.message);
  });
}
say(said);"""


def broken(site: Any, count: int, seed: int) -> list[bytes]:
    """Manifests after random mutations; none is as before, but for a mark of its encoding."""
    whole = (site / "manifest.json").read_bytes()
    found = [mutate(whole, [whole[: len(whole) // 2], b"{}"], np.random.default_rng([seed, n])) for n in range(count)]
    return [one for one in found if one.removeprefix(BOM_UTF8) != whole]


def set_in(*path: Any) -> Callable[[dict[str, Any]], None]:
    """Set a value: keys that lead to it, then what is set."""

    def change(manifest: Any) -> None:
        *keys, last, value = path
        for key in keys:
            manifest = manifest[key]
        manifest[last] = value

    return change


TEXTS: dict[str, Callable[[bytes], bytes]] = {  # of the file
    "empty": lambda whole: b"", "cut": lambda whole: whole[:-100], "null": lambda whole: b"null",
    "a list": lambda whole: b"[]", "a page": lambda whole: b"<!doctype html><title>Not found</title>",
    "no sum": lambda whole: whole.replace(b"sha256", b"md5", 1),
    "another sum": lambda whole: whole.replace(b'256":"', b'256":"0', 1),
    "NaN": lambda whole: whole.replace(b'"unit":', b'"unit":NaN,"u":', 1), "longer": lambda whole: whole + b" ",
    "a path": lambda whole: whole.replace(b"data/", b"../da", 1),
    "no UTF-8": lambda whole: whole.replace(b"name", b"n\xffme", 1),
    "levels": lambda whole: b"[" * 100_000, "zeros": lambda whole: bytes(len(whole)),
}  # fmt: skip


def test_every_change_is_noticed(javascript, box_site) -> None:
    whole = (box_site / "manifest.json").read_bytes()
    texts = [whole, *(change(whole) for change in TEXTS.values()), *broken(box_site, 60, 0)]
    first, *said = javascript(READ, [base64.b64encode(one).decode() for one in texts])
    assert first == manifest_of(box_site)["name"] and len(said) > 60
    assert {re.sub(r"version \d+;", "version 2;", one) for one in said} <= {DAMAGED, OTHER}


@pytest.fixture
def opened(chromium: Any, box_site: Any) -> Iterator[Callable[[bytes], str]]:
    """Opens the page on a manifest in one browser; what it says instead of the room. Nothing may stay uncaught."""
    manifest, faults = [b""], list[str]()

    @contextmanager
    def page_of() -> Iterator[Any]:
        with chromium() as page, served(box_site) as address:
            page.on("pageerror", lambda error: faults.append(str(error)))
            page.route("**/manifest.json", lambda route: route.fulfill(body=manifest[0]))
            yield page, address

    with page_of() as (page, address):

        def said(text: bytes) -> str:
            manifest[0] = text
            page.goto(address)
            found = str(page.wait_for_function(SAYS).json_value())
            assert page.is_visible("#message") and page.is_visible("#poster") | page.is_visible("#picture")
            assert faults == [] and len(found) < 300 and "\n" not in found, found
            return found

        yield said


@pytest.mark.slow
def test_the_page_says_that_its_manifest_is_damaged(opened: Callable[[bytes], str], box_site: Any) -> None:
    whole = (box_site / "manifest.json").read_bytes()
    assert {opened(change(whole)) for change in TEXTS.values()} == {DAMAGED}


@pytest.mark.long
def test_the_page_says_it_of_any_change(opened: Callable[[bytes], str], box_site: Any) -> None:
    assert {opened(text) for text in broken(box_site, 150, 1)} == {DAMAGED}


def first(kind: str, *path: Any) -> Callable[[dict[str, Any]], None]:
    """Set a value of the first object of a kind that has content."""

    def change(manifest: dict[str, Any]) -> None:
        at = next(at for at, one in enumerate(manifest["tables"][kind]) if "data" in one)
        set_in("tables", kind, at, *path)(manifest)

    return change


REFUSED, FETCHED, HURT = "The room cannot be shown: ", "cannot be fetched", "is damaged; export the site again"
FORGED: dict[str, tuple[Callable[[Any], None], str]] = {  # with a true checksum: change, and a part of what is said
    "no cameras": (lambda manifest: manifest.pop("cameras"), REFUSED),
    "no tables": (lambda manifest: manifest.pop("tables"), REFUSED),
    "no passes": (lambda manifest: manifest.pop("passes"), REFUSED),
    "no states": (set_in("states", []), REFUSED),
    "null for a visit": (set_in("visit", None), REFUSED),
    "a number for tables": (set_in("tables", 3), REFUSED),
    "a text for clusters": (set_in("clusters", "many"), REFUSED),
    "needs without end": (set_in("needs", "maxBufferSize", 1e300), "bytes of a buffer, the room has 1e+300"),
    "a buffer without end": (first("buffer", "size", 1e300), REFUSED),
    "a buffer below nothing": (first("buffer", "size", -64), REFUSED),
    "a texture without end": (first("texture", "size", [10**9, 10**9, 1]), "cannot"),
    "a texture below nothing": (first("texture", "size", [-1, -1, 1]), REFUSED),
    "a texture for nothing": (first("texture", "usage", 0), "The graphics device cannot show the room: "),
    "null for a texture": (set_in("tables", "texture", 0, None), REFUSED),
    "a path upwards": (set_in("tables", "shader_module", 0, "file", "../../etc/passwd"), FETCHED),
    "a path from the root": (set_in("tables", "shader_module", 0, "file", "/etc/passwd"), FETCHED),
    "another host": (set_in("tables", "shader_module", 0, "file", "https://host.example/x"), FETCHED),
    "a picture for a shader": (set_in("tables", "shader_module", 0, "file", "poster.jpg"), "cannot"),
    "other bytes": (first("texture", "data", "bytes", 3), HURT),
    "other data": (set_in("clusters", "places", "inline", "AAAA"), HURT),
    "another format": (first("texture", "format", "rgb7unorm"), REFUSED),
    "a pipeline beyond all": (set_in("passes", 0, "commands", [["setPipeline", 999], ["draw", 3]]), REFUSED),
}


@pytest.mark.long
def test_the_page_says_what_a_true_checksum_lets_through(opened: Callable[[bytes], str], box_site: Any) -> None:
    for name, (change, words) in FORGED.items():
        manifest = manifest_of(box_site)
        for key in ("format", "version", "sha256"):
            del manifest[key]
        change(manifest)
        said = opened(manifest_text(manifest).encode())
        assert words in said, (name, said)
