"""A page needs nothing but itself, is well formed, and lets no text become markup."""

from __future__ import annotations

import io
from html.parser import HTMLParser

import numpy as np
from PIL import Image

from lambent.report import page

HOSTILE = "<script>alert('x')</script> & \"quoted\" --><b>"
VOID = {"meta", "img", "br"}


class Reader(HTMLParser):
    """Collects tags and attributes; fails where nesting is broken."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert not self._open

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def check(text: str) -> Reader:
    """What every page of ours has to be."""
    read = Reader(text)
    names = [tag for tag, _ in read.tags]
    assert not {"script", "link", "iframe", "object", "form", "base"} & set(names)
    assert "@import" not in text and "url(" not in text
    for tag, attributes in read.tags:
        assert not [name for name in attributes if name.startswith("on")]
        if tag == "img":
            assert attributes["src"].startswith("data:image/png;base64,")
            assert attributes["alt"] and int(attributes["width"]) > 0 and int(attributes["height"]) > 0
        elif tag == "th":
            assert attributes["scope"] in ("row", "col")
        assert "href" not in attributes
    assert names.count("h1") <= 1 and "title" in names and ("html", {"lang": "en"}) in read.tags
    return read


def png() -> bytes:
    stream = io.BytesIO()
    Image.fromarray(np.zeros((30, 60, 3), np.uint8)).save(stream, format="PNG")
    return stream.getvalue()


def test_nothing_a_user_wrote_becomes_markup():
    body = [
        page.heading(HOSTILE, 1),
        page.paragraph(HOSTILE, "soft"),
        page.note(HOSTILE, [HOSTILE]),
        page.facts([(HOSTILE, HOSTILE)]),
        page.table((HOSTILE, HOSTILE), [(HOSTILE, HOSTILE)], caption=HOSTILE, numbers=(1,), chosen=0),
        page.row([page.picture(png(), HOSTILE, HOSTILE)]),
        page.bullets([HOSTILE]),
        page.footer(HOSTILE),
    ]
    read = check(page.page(HOSTILE, body))
    assert sum(HOSTILE in text for text in read.text) >= 12


def test_pictures_have_their_size():
    (image,) = [attributes for tag, attributes in Reader(page.picture(png(), "x", density=1.5)).tags if tag == "img"]
    assert (image["width"], image["height"]) == ("40", "20")
