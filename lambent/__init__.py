"""Lambent: real, measured materials where they will live.

table = lambent.read("brushed.bsdf")                    # or a material, a scene, a store, an image
material = table.fit(lobes="auto").material
store = lambent.bake("room.toml", "room.store")         # or lambent.open("room.store")
store.render("entrance", size=(640, 360)).save("entrance.png")

Names are imported at their first use.
"""

from __future__ import annotations

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lambent.api.bakes import Interreflection as Interreflection
    from lambent.api.bakes import bake as bake
    from lambent.api.bakes import propose as propose
    from lambent.api.benches import run_bench as run_bench
    from lambent.api.checking import check as check
    from lambent.api.converting import convert as convert
    from lambent.api.glare import glare as glare
    from lambent.api.materials import Material as Material
    from lambent.api.pictures import Comparison as Comparison
    from lambent.api.pictures import Picture as Picture
    from lambent.api.pictures import compare as compare
    from lambent.api.reading import open as open
    from lambent.api.reading import read as read
    from lambent.api.scenes import Scene as Scene
    from lambent.api.sites import export as export
    from lambent.api.stores import Store as Store
    from lambent.api.tables import Fit as Fit
    from lambent.api.tables import Table as Table
    from lambent.api.views import View as View
    from lambent.api.windows import window as window
    from lambent.core.errors import UserError as UserError

# Else numba takes them from a .numba_config.yaml of the current folder, and runs the code that such a cache holds.
for _name in ("NUMBA_CACHE_DIR", "NUMBA_CACHE_LOCATOR_CLASSES"):
    os.environ.setdefault(_name, "")

__version__ = "1.0.0"
_MODULES = {
    "Comparison": "api.pictures", "Fit": "api.tables", "Interreflection": "api.bakes", "Material": "api.materials",
    "Picture": "api.pictures", "Scene": "api.scenes", "Store": "api.stores", "Table": "api.tables",
    "UserError": "core.errors", "View": "api.views", "bake": "api.bakes", "check": "api.checking",
    "compare": "api.pictures", "convert": "api.converting", "export": "api.sites", "glare": "api.glare",
    "open": "api.reading", "propose": "api.bakes", "read": "api.reading", "run_bench": "api.benches",
    "window": "api.windows",
}  # fmt: skip
__all__ = ["__version__", *_MODULES]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'lambent' has no attribute {name!r}")
    found = getattr(import_module(f"lambent.{_MODULES[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
