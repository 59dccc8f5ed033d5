"""wgpu's C types, of which a first frame needs 85.

cffi parses each of them after the names of all 440, 13 ms each time: 1.5 of the 5 s until a window shows a room. Only
the names that occur in a type matter.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import Any

from wgpu.backends.wgpu_native._api import ffi

METHOD = "parse_type_and_quals"  # of cffi's parser; instances have their own from here on


def parse_quickly() -> None:
    """Let wgpu's types be parsed with the names that occur in them; no effect where cffi has another parser."""
    parser = getattr(ffi, "_parser", None)
    if hasattr(parser, "_declarations") and hasattr(type(parser), METHOD) and METHOD not in vars(parser):
        setattr(parser, METHOD, partial(_parsed, parser, getattr(parser, METHOD)))


def _parsed(parser: Any, parse: Callable[[str], Any], declaration: str) -> Any:
    everything, named = parser._declarations, set(re.findall(r"\w+", declaration))
    parser._declarations = {
        key: one for key, one in everything.items() if not key.startswith("typedef ") or key[8:] in named
    }
    try:
        return parse(declaration)
    finally:
        parser._declarations = everything
