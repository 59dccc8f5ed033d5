"""Baked light that answers other colours, in scenes whose light is known by hand."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from lambent.baked.answering.albedos import edited_albedos
from lambent.baked.answering.answer import solved
from lambent.baked.answering.stored import has_answer, read_answer
from lambent.baking.bake import bake
from lambent.core.errors import UserError
from lambent.core.progress import Cancelled
from lambent.materials.document import Material
from lambent.scenes.geometry import patch
from lambent.scenes.scene import Scene, SceneObject
from lambent.store.store import Store
from tests.baking.small_scenes import BLACK, TINY, furnace, room_with_step


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return bake(furnace(), tmp_path_factory.mktemp("furnace") / "s", quality=TINY, only=("answer",))


@pytest.mark.parametrize("albedo", [0.0, 0.25, 0.95])
def test_a_furnace_of_another_albedo_has_the_light_of_its_series(box: Store, albedo: float) -> None:
    """Emission .5: direct irradiance pi/2, all of it (pi/2) / (1 - a)."""
    answer = read_answer(box).answer
    found = answer.irradiance(edited_albedos([Material(kd=0.5)], [Material(kd=albedo)]), answer.reference())
    expected = np.pi / 2 / (1 - albedo)
    assert found.mean() == pytest.approx(expected, rel=0.04)
    assert np.quantile(np.abs(found / expected - 1), 0.95) < 0.15


def test_a_closed_box_loses_no_light(box: Store) -> None:
    stored = read_answer(box)
    assert stored.answer.patches.transfer.sum(axis=-1) == pytest.approx(1, abs=0.03)
    assert solved(stored.answer.patches, stored.answer.albedos).irradiance == pytest.approx(np.pi, rel=0.05)
    assert np.median(stored.answer.reference()) == pytest.approx(np.pi / 2, rel=0.03)


def sheet() -> Scene:
    """A lamp over a horizontal sheet that transmits, over a floor: the floor sees light through the sheet alone."""
    objects = (
        SceneObject("lamp", patch((-2, 1.0, -2), (4, 0, 0), (0, 0, 4)), "black", emission=(1, 1, 1)),
        SceneObject("sheet", patch((-2, 0.5, 2), (4, 0, 0), (0, 0, -4)), "paper"),
        SceneObject("floor", patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), "black"),
    )
    return Scene("sheet", objects, {"black": BLACK, "paper": Material(kd=0.2, kt_d=0.4)})


@pytest.mark.long
def test_light_through_a_sheet_follows_what_it_transmits(tmp_path: Path) -> None:
    stored = read_answer(bake(sheet(), tmp_path / "s", quality=TINY, only=("answer",)))
    answer = stored.answer
    black, paper = sheet().materials.values()
    half = [black, paper.model_copy(update={"kt_d": (0.2,) * 3})]
    found = answer.irradiance(edited_albedos([black, paper], half), answer.reference())
    floor = (stored.texels % 2 == 0) & (answer.direct[0, :, 0] < 0.02 * answer.baked[0].max())
    floor &= answer.baked[0, :, 0] > 0.3 * np.median(answer.baked[0][floor])
    ratio = found[0][floor] / answer.baked[0][floor]
    assert floor.sum() > 100 and np.median(ratio) == pytest.approx(0.5, abs=0.02)


@pytest.mark.long
def test_an_interrupted_answer_goes_on_and_ends_the_same(tmp_path: Path) -> None:
    whole = bake(room_with_step(), tmp_path / "whole", quality=TINY, only=("answer",))
    for at in ("direct light", "gathering", "answer of the probe of ball"):

        def stop(done: float, total: float, what: str, at: str = at) -> None:
            if what == at and (done > 0 or total == 1):
                raise Cancelled

        with pytest.raises(Cancelled):
            bake(room_with_step(), tmp_path / "parts", quality=TINY, only=("answer",), progress=stop)
    parts = bake(room_with_step(), tmp_path / "parts", quality=TINY, only=("answer",))
    names = [a.name for a in whole.artefacts() if a.name.startswith("answer/")]
    assert {a.name for a in parts.artefacts()} == {a.name for a in whole.artefacts()}
    for name in names:
        assert np.array_equal(parts.read(name), whole.read(name)), name
    seen = read_answer(whole).seen["ball"]
    assert (seen.texel >= 0).mean() > 0.9, "the probe stands in a closed room"


def test_a_store_without_an_answer_says_so(tmp_path: Path) -> None:
    store = Store.create(tmp_path / "s", {})
    assert not has_answer(store)
    with pytest.raises(UserError, match="--only answer"):
        read_answer(store)


def test_an_answer_that_contradicts_itself_is_refused(box: Store, tmp_path: Path) -> None:
    shutil.copytree(box.folder, tmp_path / "s")
    with Store.open(tmp_path / "s") as store:
        store.put("answer/patch_paired", "answer", np.full(3, 7, np.uint16), key="other")
        with pytest.raises(UserError, match="broken store"):
            read_answer(store)
