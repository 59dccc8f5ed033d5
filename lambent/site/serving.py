"""A server for one site, on this machine unless told otherwise."""

from __future__ import annotations

import errno
import gzip
import io
import re
from functools import partial
from http import HTTPStatus
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from lambent.core.errors import UserError
from lambent.core.inputs import read_bytes
from lambent.site.replacing import is_unfinished

TYPES = {
    ".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8", ".css": "text/css; charset=utf-8",
    ".json": "application/json", ".wgsl": "text/plain; charset=utf-8", ".gz": "application/gzip", ".jpg": "image/jpeg",
    ".webp": "image/webp", ".avif": "image/avif",
}  # fmt: skip
TEXTS, TEXT_BYTES = re.compile(r"text/|application/json"), 1 << 28  # what is compressed on the way
LOOPBACK = ("127.0.0.1", "localhost", "::1")
FOREVER = "public, max-age=31536000, immutable"  # names of data and shaders are hashes of their content


class SiteServer(ThreadingHTTPServer):
    """Serves the files of a folder, and nothing else. `address` is what a browser opens."""

    daemon_threads = True

    def __init__(self, folder: Path, host: str = "127.0.0.1", port: int = 0) -> None:
        """Port 0: any free one. Raises `UserError` if the folder is no site or the port is taken."""
        if not (folder / "manifest.json").is_file() or not (folder / "index.html").is_file():
            what = "holds an export that did not come to its end" if is_unfinished(folder) else "is no site"
            raise UserError(what, file=folder, hint="make one: lambent export STORE -o SITE")
        self.folder, self.is_local = folder.resolve(), host in LOOPBACK
        try:
            super().__init__((host, port), partial(_Handler, directory=str(self.folder)))
        except OSError as error:
            taken = error.errno in (errno.EADDRINUSE, errno.EACCES, errno.EADDRNOTAVAIL)
            if not taken:
                raise
            raise UserError("cannot be served there", field="--port", got=f"{host}:{port}") from error

    @property
    def address(self) -> str:
        host, port = self.server_address[:2]
        return f"http://{host!s}:{port}/"


class _Handler(SimpleHTTPRequestHandler):
    server: SiteServer
    extensions_map = TYPES

    def send_head(self) -> Any:
        """The file, if it is one of the site's and the request comes by the server's own name."""
        name = self.headers.get("Host", "").rsplit(":", 1)[0].strip("[]")
        if self.server.is_local and name not in LOOPBACK:  # a page elsewhere whose name leads here
            self.send_error(HTTPStatus.FORBIDDEN)
            return None
        path = self._asked()
        if path is None or path.suffix not in TYPES:
            self.send_error(HTTPStatus.NOT_FOUND)
            return None
        if TEXTS.match(TYPES[path.suffix]) and "gzip" in self.headers.get("Accept-Encoding", ""):
            return self._packed(path)
        return super().send_head()

    def _packed(self, path: Path) -> io.BytesIO:
        """The file compressed: shaders and manifest are a megabyte of text."""
        packed = gzip.compress(read_bytes(path, TEXT_BYTES), mtime=0)
        self.send_response(HTTPStatus.OK)
        headers = {"Content-Type": TYPES[path.suffix], "Content-Encoding": "gzip", "Content-Length": str(len(packed))}
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        return io.BytesIO(packed)

    def _asked(self) -> Path | None:
        """The file that is asked for, if it is in the folder."""
        try:
            path = Path(self.translate_path(self.path)).resolve()
        except ValueError:  # a name with a zero byte
            return None
        path = path / "index.html" if path == self.server.folder else path
        return path if path.is_relative_to(self.server.folder) and path.is_file() else None

    def end_headers(self) -> None:
        parts = self.path.split("?")[0].split("/")
        self.send_header("Cache-Control", FOREVER if {"data", "shaders"} & {*parts} else "no-cache")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        super().end_headers()

    def log_message(self, format: str, *arguments: Any) -> None:
        """Nothing: requests are no news."""
