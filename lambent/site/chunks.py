"""Files of a site's data: predicted from their neighbours, compressed, and named by their content.

Words of 1, 2 or 4 bytes stand in records of `channels`. Each is stored as its difference from the same channel of the
record before, in runs of which the words after the first `back` begin as differences from those `back` words earlier:
cube maps of an array differ by a lamp or two. First all lowest bytes of the first channel, of the second, ... then the
bytes above. Gzip then finds four times as much as in the words themselves, and nothing is lost. Colours of textures are
pictures, which lose a little.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, features

from lambent.core.files import write_bytes

LEVEL = 9
PICTURE_QUALITY, AVIF_QUALITY = 90, 88
OPAQUE = 255
INLINE = 1024  # packed bytes that stand in the manifest: a request costs more
TALLEST_PX = 16383  # of WebP


@dataclass(frozen=True)
class Packing:
    """How data are predicted: bytes of a word, channels of a record, and (words, back) of each run."""

    word: int
    channels: int
    runs: Sequence[tuple[int, int]]

    def packed(self, data: bytes) -> bytes:
        """The differences, byte by byte."""
        words, at, parts = np.frombuffer(data, f"<u{self.word}"), 0, []
        for count, back in self.runs:
            run = words[at : at + count].copy()
            if back:
                run[back:] -= words[at : at + count - back]
            records = run.reshape(-1, self.channels)
            records[1:] -= records[:-1].copy()
            planes = np.ascontiguousarray(records.T).view(np.uint8).reshape(self.channels, -1, self.word)
            parts.append(planes.transpose(2, 0, 1).tobytes())
            at += count
        return b"".join(parts)

    def said(self) -> dict[str, Any]:
        """For the manifest."""
        return {"word": self.word, "channels": self.channels, "runs": [list(run) for run in self.runs]}


class Chunks:
    """Writes data into the folder `data` of a site; equal data share a file."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder / "data"
        self._folder.mkdir(parents=True, exist_ok=True)
        self.files: dict[str, int] = {}  # bytes transferred, by name
        self._added: dict[str, dict[str, Any]] = {}  # what `add` returned, by name
        self._pictures: dict[str, dict[str, Any]] = {}  # by the hash of their texels

    def add_picture(self, levels: Sequence[NDArray[np.uint8]]) -> dict[str, Any]:
        """MIP levels (rows, columns, 4) of a picture, one below the other in a file; alpha stays exact."""
        tall = np.full((sum(len(level) for level in levels), levels[0].shape[1], 4), OPAQUE, np.uint8)
        at = 0
        for level in levels:
            tall[at : at + len(level), : level.shape[1]] = level
            at += len(level)
        key = hashlib.sha256(tall.tobytes()).hexdigest()
        if key not in self._pictures:
            self._pictures[key] = self._written(tall)
        return self._pictures[key]

    def _written(self, tall: NDArray[np.uint8]) -> dict[str, Any]:
        made, is_opaque = io.BytesIO(), bool((tall[..., 3] == OPAQUE).all())
        if is_opaque and features.check("avif"):  # WebP halves the resolution of hues, AVIF has no exact alpha
            form = "avif"
            Image.fromarray(tall[..., :3]).save(made, form, quality=AVIF_QUALITY, subsampling="4:4:4")
        else:
            form = "webp"
            Image.fromarray(tall).save(made, form, quality=PICTURE_QUALITY, exact=True)
        content = made.getvalue()
        digest = hashlib.sha256(content).hexdigest()
        name = f"data/{digest[:20]}.{form}"
        write_bytes(self._folder.parent / name, content)
        self.files[name] = size = len(content)
        return {"file": name, "bytes": size, "packed": size, "picture": True}

    def add_table(self, table: NDArray[Any]) -> dict[str, Any]:
        """Where a table (rows, columns) of words of 4 bytes is."""
        return self.add(table.tobytes(), Packing(4, table.shape[1], [(table.size, 0)]))

    def add(self, data: bytes, packing: Packing | None = None) -> dict[str, Any]:
        """Where `data` is: a file relative to the site, bytes unpacked and packed, packing.

        The file is named by the SHA-256 of data and packing: the same data packed in another way is another file.
        """
        said = {} if packing is None else {"packing": packing.said()}
        digest = hashlib.sha256(data)
        digest.update(json.dumps(said).encode())
        name = f"data/{digest.hexdigest()[:20]}.gz"
        if name not in self._added:
            packed = gzip.compress(data if packing is None else packing.packed(data), LEVEL, mtime=0)
            found: dict[str, Any] = {"file": name, "bytes": len(data), "packed": len(packed)}
            if len(packed) <= INLINE:
                found["inline"] = base64.b64encode(packed).decode()
            else:
                write_bytes(self._folder.parent / name, packed)
                self.files[name] = len(packed)
            self._added[name] = {**found, **said}
        return dict(self._added[name])
