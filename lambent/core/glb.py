"""The GLB container (glTF 2.0, section 4)."""

from __future__ import annotations

import json
import struct
from typing import Any


def glb_bytes(document: dict[str, Any], buffer: bytes) -> bytes:
    """A .glb file of a glTF document and its one buffer."""
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    buffer += b"\0" * (-len(buffer) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(buffer), b"BIN\0") + buffer
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
