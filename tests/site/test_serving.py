"""The server: a site's files with their types, to this machine, and nothing outside the folder."""

from __future__ import annotations

import gzip
import http.client
import os
import threading

import pytest

from lambent.core.errors import UserError
from lambent.site.replacing import replacing
from lambent.site.serving import SiteServer


@pytest.fixture
def site(tmp_path):
    folder = tmp_path / "site"
    (folder / "data").mkdir(parents=True)
    for name, text in (
        ("index.html", "<title>room</title>"),
        ("main.js", "1;"),
        ("manifest.json", "{}"),
        ("data/a.gz", ""),
    ):
        (folder / name).write_text(text)
    (tmp_path / "secret.json").write_text("secret")
    os.symlink(tmp_path / "secret.json", folder / "link.json")
    (folder / "notes.txt").write_text("mine")
    return folder


@pytest.fixture
def ask(site):
    with SiteServer(site) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()

        def request(path, method="GET", **headers):
            connection = http.client.HTTPConnection("127.0.0.1", server.server_address[1])
            connection.request(method, path, headers=headers)
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()

        yield request
        server.shutdown()
        thread.join()


def test_files_have_their_types(ask):
    status, headers, body = ask("/")
    assert status == 200 and b"room" in body and headers["Content-Type"].startswith("text/html")
    assert headers["X-Content-Type-Options"] == "nosniff" and headers["Cache-Control"] == "no-cache"
    status, headers, _ = ask("/main.js?x=1")
    assert status == 200 and headers["Content-Type"].startswith("text/javascript")
    status, headers, _ = ask("/data/a.gz", "HEAD")
    assert status == 200 and headers["Content-Type"] == "application/gzip" and "immutable" in headers["Cache-Control"]


def test_texts_are_compressed_for_browsers_that_unpack_them(ask, site):
    (site / "manifest.json").write_text('{"ä": 1}' * 1000, "utf-8")
    status, headers, body = ask("/manifest.json", **{"Accept-Encoding": "gzip, br"})
    assert status == 200 and headers["Content-Encoding"] == "gzip" and int(headers["Content-Length"]) == len(body) < 200
    assert gzip.decompress(body) == (site / "manifest.json").read_bytes()
    assert ask("/manifest.json")[2] == (site / "manifest.json").read_bytes()
    status, headers, body = ask("/data/a.gz", **{"Accept-Encoding": "gzip"})
    assert status == 200 and "Content-Encoding" not in headers, "the page unpacks these itself"
    assert ask("/link.json", **{"Accept-Encoding": "gzip"})[0] == 404


@pytest.mark.parametrize(
    "path", ["/../secret.json", "/%2e%2e/secret.json", "/..%2fsecret.json", "//../secret.json", "/link.json", "/data/",
             "/notes.txt", "/nothing.js", "/data/../../secret.json", "/\\..\\secret.json", "/%00"],
)  # fmt: skip
def test_nothing_else_is_served(ask, path):
    status, _, body = ask(path)
    assert status == 404 and b"secret" not in body


def test_only_this_machines_names_and_only_reading(ask):
    assert ask("/", Host="rooms.example:80")[0] == 403
    assert ask("/", Host="localhost:1")[0] == 200
    for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE", "CONNECT"):
        assert ask("/", method)[0] == 501, method
    for host in ("rooms.example", "localhost.example", "127.0.0.1.example:80", ""):
        assert ask("/", Host=host)[0] == 403, host


def test_no_other_site_may_read(ask):
    for path in ("/", "/data/a.gz", "/nothing"):
        headers = ask(path, Origin="https://rooms.example")[1]
        assert not [name for name in headers if name.lower().startswith("access-control-")]


def test_what_cannot_be_served_is_said(tmp_path, site):
    with pytest.raises(UserError, match=r"is no site; make one: lambent export"):
        SiteServer(tmp_path)
    with pytest.raises(KeyboardInterrupt), replacing(tmp_path, "lambent site", ()):
        raise KeyboardInterrupt
    with pytest.raises(UserError, match=r"holds an export that did not come to its end; make one: lambent export"):
        SiteServer(tmp_path)
    with SiteServer(site) as server, pytest.raises(UserError, match="cannot be served there"):
        SiteServer(site, port=server.server_address[1])
