"""Kinds of artefacts are found by their files; their keys stay what they were."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lambent.baking import artefacts
from lambent.baking.bake import bake, found, in_order
from lambent.baking.context import BakeContext
from lambent.baking.methods import chosen
from lambent.baking.quality import quality_named
from lambent.core.errors import UserError
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.progress import Cancelled, silent
from lambent.scenes.scene import ConstantEnvironment, MaterialTextures, PointLight, Scene, Texture
from lambent.store.store import Store
from tests.baking.small_scenes import MIRROR, TINY, plane, room_with_step

TOY = '''
"""Areas of triangles."""

from lambent.baking.running.keys import key_of
from lambent.baking.running.tiles import run_tiles
from lambent.core.geometry.triangles import triangle_areas

KIND = "areas"
NEEDS = ("geometry",)
NAME = "areas/m2"


def keys(context):
    return {NAME: key_of(KIND, 1, context.keys("geometry")["geometry/faces"])}


def bake(context):
    corners = context.geometry["positions"][context.geometry["faces"]]
    writer = context.samples(KIND, NAME, corners.shape[:1], (100,))
    run_tiles(
        writer, lambda region, seed: triangle_areas(corners[region]), seed=0, progress=context.progress, what="areas"
    )
    writer.finish()
'''


@pytest.fixture
def toy(tmp_path: Path) -> Iterator[str]:
    """A kind of artefact in a folder of its own, as a plug-in brings it."""
    folder = tmp_path / "plug_in"
    folder.mkdir()
    (folder / "areas.py").write_text(TOY)
    artefacts.__path__.append(str(folder))
    importlib.invalidate_caches()
    yield "areas"
    artefacts.__path__.pop()
    sys.modules.pop(f"{artefacts.__name__}.areas", None)


def test_a_kind_of_artefact_is_one_file(toy: str, tmp_path: Path) -> None:
    steps: list[str] = []

    def baked(stop_after: float = 1.0, **options: object) -> Store:
        def tell(done: float, total: float, what: str) -> None:
            steps.append(what)
            if what == toy and 0 < done / total >= stop_after and stop_after < 1:
                raise Cancelled

        steps.clear()
        return bake(room_with_step(), tmp_path / "s", quality=TINY, only=[toy], progress=tell, **options)

    with pytest.raises(Cancelled):
        baked(stop_after=0.3)
    half = Store.open(tmp_path / "s")
    whole = len(half.read("geometry/faces"))
    assert half.artefacts()[-1].kind == "raw" and "areas/m2" not in half and "unwrapping" in steps
    begun = steps.count(toy)
    store = baked()
    assert {a.name.partition("/")[0] for a in store.artefacts()} == {"geometry", toy}, "with its need, and nothing else"
    corners = store.read("geometry/positions")[store.read("geometry/faces")]
    np.testing.assert_array_equal(store.read("areas/m2"), triangle_areas(corners).astype(np.float32))
    assert "unwrapping" not in steps and begun + steps.count(toy) == -(-whole // 100) + 2, "each chunk is baked once"
    assert store.documents["timings"].keys() == {"geometry", "parts", "backs", "reflectors", toy}
    assert store.documents["last_run"].keys() == {toy, "other"}
    baked()
    assert toy not in steps, "it is up to date"
    assert Store.open(tmp_path / "s").documents["last_run"].keys() == {"other"}
    baked(resume=False)
    assert {"unwrapping", toy} <= set(steps)


def test_the_command_offers_every_kind_there_is(toy: str) -> None:
    command = importlib.import_module("lambent.cli.bake")
    try:
        offered = {str(kind) for kind in importlib.reload(command).Kind}
    finally:
        artefacts.__path__.pop()
        own = {str(kind) for kind in importlib.reload(command).Kind}
        artefacts.__path__.append(toy)
    assert {"geometry", "light_map", "transport"} < own and offered == {*own, toy}


def kinds(**needs: tuple[str, ...]) -> dict[str, SimpleNamespace]:
    return {name: SimpleNamespace(KIND=name, NEEDS=those) for name, those in needs.items()}


def test_what_is_needed_comes_first() -> None:
    some = kinds(a=("c",), b=(), c=("d",), d=())
    assert in_order(some, ["a"]) == ["d", "c", "a"]
    order = in_order(some, some)
    assert sorted(order) == ["a", "b", "c", "d"] and order.index("d") < order.index("c") < order.index("a")


@pytest.mark.parametrize(
    ("needs", "said"),
    [
        ({"a": ("b",), "b": ("a",)}, "circle.*a -> b|b -> a"),
        ({"a": ("bee",), "bees": ()}, "NEEDS of a: unknown artefact.*'bees'"),
    ],
    ids=["circle", "unknown need"],
)
def test_needs_that_cannot_be_met_are_told(needs: dict[str, tuple[str, ...]], said: str) -> None:
    with pytest.raises(UserError, match=said):
        in_order(kinds(**needs), ["a"])


def test_settings_of_an_unknown_kind_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="did you mean 'light_map'"):
        bake(plane(), tmp_path / "s", quality=TINY.changed(lightmap={"max_depth": 3}))


def bumpy_mirror() -> Scene:
    bumps = np.zeros((1, 1, 3), np.float16)
    bumps[..., 2] = 1
    return replace(
        plane(),
        materials={"black": MIRROR}, textures={"black": MaterialTextures(normal=Texture(bumps))},
        environment=ConstantEnvironment((1.0, 0.5, 0.25)), lights=(PointLight((0.0, 1.0, 0.0), (1.0, 1.0, 1.0)),),
    )  # fmt: skip


NAMES = (
    "geometry/uv2",
    "environment/radiance",
    "SAMPLES",
    "light_map/lean",
    "probe/floor/distance",
    "probe/floor/planes",
)
PINNED = {
    ("preview", "paths", "cached"): "1dec1a65 4cae5d96 89037d89 d530bacc 2607c970 4ccee2c5",
    ("normal", "photons", "traced"): "6161cd22 5095e777 419cd75d 9df0ee10 7643cc0e 8965975c",
    ("final", "photons", "traced"): "a38141f9 cef94a2c 2f43af1a 4f3526ab eed2028c d9b3d272",
}


@pytest.mark.parametrize("case", PINNED, ids="-".join)
def test_stores_of_older_bakes_are_up_to_date(tmp_path: Path, case: tuple[str, str, str]) -> None:
    """Keys since paths go by way of lit texels: where one changes without need, everybody bakes again."""
    quality, light_map, probes = case
    store = Store.create(tmp_path / "s", {})
    methods = chosen({}, light_map=light_map, probes=probes)
    context = BakeContext(bumpy_mirror(), store, found(), quality_named(quality), methods, 0, silent)
    keys = {name: key for kind in found() for name, key in context.keys(kind).items()}
    keys["SAMPLES"] = keys["light_map/photons" if light_map == "photons" else "light_map/traced"]
    assert keys["light_map/leaning"] == keys["SAMPLES"] and keys["light_map/noise"] == keys["light_map/lean"]
    assert " ".join(keys[name][:8] for name in NAMES) == PINNED[case]
