"""A store as a page of stills: pictures, hostile names, before and after in a browser; without scripts; on paper."""

from __future__ import annotations

import io
import json
import re
import shutil
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

import lambent
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.store.kept.session import FILE, RoomState, WalkSession, write_session
from lambent.store.kept.views import Views, change_views
from tests.site.conftest import served

SIZE = 240, 240
VIEWPORT = {"width": 320, "height": 400}  # the picture takes .6 of its height
HOSTILE, ROOM = '<script>alert("1")</script>', "Küche & <b>部屋</b> $links"
VIEW = Camera('"><img src=x onerror=alert(2)> fenêtre', (0.6, 0.3, 0.8), (-0.8, -0.2, -0.4))
STATES = ["as baked", "blue", HOSTILE]


class Page(HTMLParser):
    """Gathers tags, texts by tag, and the attributes of pictures."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags, self.pictures, self.files, self.texts, self._open = [], [], [], {}, ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self._open = tag
        if tag == "img" and "src" in dict(attrs):
            self.files.append(dict(attrs)["src"])
        if tag == "img" and dict(attrs).get("alt"):
            self.pictures.append(dict(attrs))

    def handle_data(self, data):
        if data.strip():
            self.texts.setdefault(self._open, []).append(data)


@pytest.fixture(scope="module")
def store(baked_box, tmp_path_factory):
    """The box, with names that are no HTML, a saved view, and two states of its red wall."""
    folder = shutil.copytree(baked_box, tmp_path_factory.mktemp("hostile") / "box.store")
    red = {"blue": (0.05, 0.1, 0.7), HOSTILE: (0.1, 0.6, 0.1)}
    walls = {name: Material(name="red", kd=kd, lobes=(Lobe(mx=0.1, my=0.1),)) for name, kd in red.items()}
    write_session(
        folder / FILE, WalkSession(states={name: RoomState(materials={"red": one}) for name, one in walls.items()})
    )
    change_views(folder, lambda views: Views(cameras=(VIEW,)))
    manifest = json.loads((folder / "manifest.json").read_text())
    manifest["documents"]["scene"]["name"] = ROOM
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return folder


@pytest.fixture(scope="module")
def stills(store, tmp_path_factory):
    folder = tmp_path_factory.mktemp("stills") / "box"
    made = lambent.export(store, folder, as_="html", size=SIZE)
    assert (made["views"], made["states"], made["files"]) == (2, 3, 8)
    return folder


def numbers(folder) -> list[str]:
    """Views, and views with states, of the pictures of a page, whose names end in their hashes."""
    return sorted(one.stem.rpartition("-")[0] for one in (folder / "pictures").iterdir())


def test_the_page_names_every_still(stills):
    text = (stills / "index.html").read_text("utf-8")
    page = Page(text)
    assert page.tags.count("script") == 1 and "onerror" not in {key for one in page.pictures for key in one}
    assert page.texts["h1"] == page.texts["title"] == [ROOM] and page.texts["h2"] == ["front", VIEW.name]
    assert [one["alt"] for one in page.pictures] == [f"{view}, {s}" for view in ("front", VIEW.name) for s in STATES]
    captions = page.texts["figcaption"]
    assert all(re.fullmatch(r".*, EV100 -?\d+\.\d", one) for one in captions) and captions[5].startswith(HOSTILE)
    assert numbers(stills) == ["1", "1-1", "1-2", "1-3", "2", "2-1", "2-2", "2-3"]
    assert {one.relative_to(stills).as_posix() for one in (stills / "pictures").iterdir()} == set(page.files)
    assert "http:" not in text and "https:" not in text, "no third party is asked"


@pytest.mark.long
def test_stills_are_those_of_the_store(store, stills):
    opened = lambent.open(store)
    for view, camera in enumerate(("front", VIEW.name), 1):
        shown = {state: picture(stills, view, k) for k, state in enumerate(STATES, 1)}
        exposure_ev = opened.render(camera, size=SIZE).exposure_ev
        for state, variant in zip(STATES, ("", "blue", HOSTILE), strict=True):
            wanted = opened.render(camera, size=SIZE, variant=variant, exposure_ev=exposure_ev).shown.astype(float)
            errors = {name: np.abs(one - wanted).mean() for name, one in shown.items()}
            assert errors.pop(state) < 2, "what WebP loses"
            assert min(errors.values()) > 3


def picture(folder, view: int, state: int):
    (file,) = (folder / "pictures").glob(f"{view}-{state}-*.webp")
    return np.asarray(Image.open(file).convert("RGB"), float)


@pytest.mark.long
def test_an_interrupted_export_leaves_what_was_there(store, tmp_path):
    def stop(done, total, what):
        if done > 0.5 * total:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lambent.export(store, tmp_path, as_="html", size=(32, 24), progress=stop)
    assert not (tmp_path / "index.html").exists() and numbers(tmp_path) == []
    lambent.export(store, tmp_path, as_="html", size=(32, 24), views=["front"])
    assert numbers(tmp_path) == ["1", "1-1", "1-2", "1-3"]
    former = {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()}
    with pytest.raises(KeyboardInterrupt):
        lambent.export(store, tmp_path, as_="html", size=(48, 36), progress=stop)
    assert {one: one.read_bytes() for one in tmp_path.rglob("*") if one.is_file()} == former
    (tmp_path / "pictures/old.webp").write_bytes(b"old")
    lambent.export(store, tmp_path, as_="html", size=(48, 36))
    assert len(numbers(tmp_path)) == 8
    with pytest.raises(UserError, match="holds other files than a site"):
        lambent.export(store, tmp_path)


def test_what_cannot_be_exported_is_said(store, tmp_path):
    (tmp_path / "letter.txt").write_text("dear")
    for options, message in (
        ({}, "holds other files than stills"),
        ({"as_": "site", "size": SIZE}, r"applies to stills only.*--size|--size.*applies to stills only"),
        ({"as_": "pdf"}, "unknown kind of export"),
    ):
        with pytest.raises(UserError, match=message):
            lambent.export(store, tmp_path, **{"as_": "html", **options})
    for options, message in (
        ({"views": ["frnt"]}, "unknown view.*frnt"),
        ({"size": (20000, 20)}, "larger than a WebP"),
    ):
        with pytest.raises(UserError, match=message):
            lambent.export(store, tmp_path / "new", as_="html", **options)
    assert not (tmp_path / "new").exists()


def seen(page):
    """The upper picture as the browser shows it (height, width, 3)."""
    page.locator("#pair").scroll_into_view_if_needed()
    box = {key: round(value) for key, value in page.locator("#pair").bounding_box().items()}
    return np.asarray(Image.open(io.BytesIO(page.screenshot(clip=box))).convert("RGB"), float)


def assert_before_and_after(page, stills, view, before, after, at: int):
    """Columns left of the line come from one state, those right of it from the other; `at` is in percent."""
    page.wait_for_function("() => [...document.querySelectorAll('#pair img')].every((i) => i.complete)")
    assert page.input_value("#between") == str(at)
    shown, line = seen(page), round(SIZE[0] * at / 100)
    for columns, state, other in ((slice(0, line - 24), before, after), (slice(line + 24, None), after, before)):
        if columns.stop is None or columns.stop > 0:
            right, wrong = (np.abs(shown - picture(stills, view, s))[:, columns].mean() for s in (state, other))
            assert right < 2 and wrong > 3 * right


@pytest.mark.long
def test_before_and_after(chromium, stills):
    """By keys, by touch, with other states and another view; from a server and from the disk."""
    with chromium(has_touch=True) as page, served(stills) as address:
        faults = []
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("dialog", lambda dialog: faults.append(dialog.message))
        page.on("console", lambda message: faults.append(message.text))
        page.set_viewport_size(VIEWPORT)
        page.goto(address)
        assert page.get_by_role("slider", name="before").is_visible()
        assert_before_and_after(page, stills, 1, 1, 2, 50)
        page.focus("#between")
        for _ in range(20):
            page.keyboard.press("ArrowRight")
        assert_before_and_after(page, stills, 1, 1, 2, 70)
        assert page.get_attribute("#between", "aria-valuetext") == "70 % as baked, the rest blue"
        page.keyboard.press("Home")
        assert_before_and_after(page, stills, 1, 1, 2, 0)
        page.select_option("#state-before", HOSTILE)
        page.click("#links a >> nth=1")
        assert page.get_attribute("#links a >> nth=1", "aria-current") == "true"
        box = page.locator("#pair").bounding_box()
        page.touchscreen.tap(box["x"] + 0.4 * box["width"], box["y"] + 20)
        assert_before_and_after(page, stills, 2, 3, 2, 40)
        page.goto((stills / "index.html").as_uri())
        assert_before_and_after(page, stills, 1, 1, 2, 50)
        assert faults == []


@pytest.mark.long
def test_without_scripts_and_on_paper_all_stills_are_there(chromium, stills):
    with chromium(java_script_enabled=False) as page, served(stills) as address:
        page.goto(address, wait_until="load")
        assert not page.is_visible("#compare") and page.get_by_role("link").count() == 2
        assert [one.is_visible() for one in page.locator("figure img").all()] == [True] * 6
        page.click("#links a >> nth=1")
        assert page.url == f"{address}#view-2"
    with chromium() as page, served(stills) as address:
        page.goto(address, wait_until="load")
        paper = page.pdf(format="A4")
        assert len(re.findall(rb"/Type\s*/Page\b", paper)) == 2, "a page for each view"
        assert len(re.findall(rb"/Subtype\s*/Image", paper)) == 6
        page.emulate_media(media="print")
        assert not page.is_visible("#compare") and not page.is_visible("#links")
        assert [one.is_visible() for one in page.locator("figure img").all()] == [True] * 6
