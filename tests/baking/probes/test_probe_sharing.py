"""Neighbours that share a probe, and objects that have none."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.probes.sharing import MOST, _grouped, _largest, _reach
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.realtime.light.baked import read_baked
from lambent.scenes.geometry import box, merge, patch, placed, sphere
from lambent.scenes.scene import ConstantEnvironment, Scene, SceneObject
from lambent.store.contract import probe_name, scene_record, shared_probes
from lambent.store.store import Store
from tests.baking.small_scenes import BLACK, GREY, TINY, room_with_step

CAMERA = Camera("door", (-1.8, 1.5, 1.8), (0.0, 0.5, 0.0))


def laid_table() -> Scene:
    """A room with a block; six beads beside each other on one side of it, two far away, one as large as a pin."""
    room = room_with_step()
    row = [(-1.5 + 0.12 * i, 0.6, -1.5) for i in range(6)]
    beads = [SceneObject(f"bead{i}", placed(sphere(0.04, 12, 8), at), "mirror") for i, at in enumerate(row)]
    beads += [SceneObject("behind", placed(sphere(0.04, 12, 8), (1.9, 0.3, 1.9)), "mirror")]  # the block hides the row
    beads += [SceneObject("pin", placed(sphere(0.0005, 8, 6), (-1.0, 0.6, 0.5)), "mirror")]
    return replace(room, objects=(*room.objects, *beads), cameras=(CAMERA,))


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of the laid table's probes."""
    folder = tmp_path_factory.mktemp("table") / "s"
    bake_probes(laid_table(), folder).close()
    return folder


def bake_probes(scene: Scene, folder: Path) -> Store:
    return bake(scene, folder, quality=TINY, only=("probe",))


def probes_of(store: Store) -> set[str]:
    return {o.name for o in scene_record(store).objects if probe_name(o.name, "radiance") in store}


def test_neighbours_share_and_a_pin_has_none(table: Path) -> None:
    store = Store.open(table)
    owners, own = shared_probes(store), probes_of(store)
    row = {f"bead{i}" for i in range(6)}
    assert "pin" in owners and "ball" in own
    assert len(row & own) <= 3 and {owners[name] for name in row - own} <= own, "whose probe is shown has one"
    assert own.isdisjoint(owners) and own | set(owners) == row | {"ball", "behind", "pin"}
    shown = read_baked(store)
    assert not [told for told in shown.missing if told.startswith("probe/")], "a shared probe is not missing"
    records = {o.name: o for o in scene_record(store).objects}
    for name, owner in owners.items():
        assert shown.probe_of(records[name]) is shown.probes[owner]
    before = {a.name: a.key for a in store.artefacts()}
    with bake_probes(laid_table(), table) as again:
        assert {a.name: a.key for a in again.artefacts()} == before


@pytest.mark.long
def test_an_object_that_gets_its_own_probe_again_is_baked(table: Path, tmp_path: Path) -> None:
    folder = tmp_path / "s"
    shutil.copytree(table, folder)
    shared = min(shared_probes(Store.open(folder)))
    with bake_probes(replace(laid_table(), probe_centres={shared: (0.0, 1.0, 0.0)}), folder) as again:
        assert shared in probes_of(again) and shared not in shared_probes(again)
        assert again.artefact(probe_name(shared, "radiance")).meta["centre"] == [0.0, 1.0, 0.0]
    assert shared not in probes_of(bake_probes(laid_table(), folder)), "what is no longer shown is dropped"


@pytest.mark.long
def test_a_lamp_is_not_left_out_of_its_neighbours_reflections(tmp_path: Path) -> None:
    scene = laid_table()
    lit = tuple(replace(o, emission=(3.0, 3.0, 3.0)) if o.name == "bead2" else o for o in scene.objects)
    owners = shared_probes(bake_probes(replace(scene, objects=lit), tmp_path / "s"))
    assert "bead2" not in owners.values() and "bead2" not in owners


@pytest.mark.long
def test_no_probe_shows_a_lamp_without_its_shade(tmp_path: Path) -> None:
    """Beads under a lamp in a tray: a probe that they share with the tray leaves it out, and shows them the lamp."""
    walls = [((0.16, 0.01, 0.16), (0, 0, 0))]
    walls += [((0.01, 0.08, 0.16), (sign * 0.08, 0.04, 0)) for sign in (-1, 1)]
    walls += [((0.16, 0.08, 0.01), (0, 0.04, sign * 0.08)) for sign in (-1, 1)]
    tray = placed(merge([placed(box(size), at) for size, at in walls]), (-1.2, 0.7, -1.5))
    lamp = placed(box((0.1, 0.01, 0.1)), (-1.2, 0.72, -1.5))
    beads = [
        SceneObject(f"bead{i}", placed(sphere(0.03, 12, 8), (-1.24 + 0.08 * i, 0.6, -1.5)), "mirror") for i in range(2)
    ]
    room = room_with_step()
    lit = [SceneObject("tray", tray, "mirror"), SceneObject("disc", lamp, "black", emission=(500.0,) * 3), *beads]
    store = bake_probes(replace(room, objects=(*room.objects, *lit), cameras=(CAMERA,)), tmp_path / "s")
    shown = {name: shared_probes(store).get(name, name) for name in ("bead0", "bead1")}
    trays = {shared_probes(store).get(o.name, o.name) for o in scene_record(store).objects if o.name.startswith("tray")}
    assert not any(name.startswith("tray") for name in shown.values()) and trays.isdisjoint(shown.values())
    for name in shown.values():
        array = store.artefact(probe_name(name, "radiance"))
        assert float(store.read(array.name).astype(float).max()) * array.meta["unit"] < 250, "the lamp is hidden"


@pytest.mark.long
def test_in_a_closed_room_no_probe_shows_the_sky(tmp_path: Path) -> None:
    """Not even through the floor, ceiling or wall whose probe it is, or that another object shares."""
    glossy = Material(kd=(0.5, 0.5, 0.5), lobes=(Lobe(mx=0.6, my=0.6, r0=(0.04,) * 3),))
    sides = [(axis, sign) for axis in range(3) for sign in (-1, 1)]
    slabs = [
        SceneObject(f"slab{axis}{sign}", placed(box(np.where(np.arange(3) == axis, 0.3, 4.6)),
                                                np.where(np.arange(3) == axis, 2.15 * sign, 0.0)), "glossy")
        for axis, sign in sides
    ]  # fmt: skip
    ball = SceneObject("ball", placed(sphere(0.2, 12, 8), (0.5, 0.0, 0.3)), "glossy")
    lamp = SceneObject("lamp", patch((-0.5, 1.9, -0.5), (1, 0, 0), (0, 0, 1)), "black", emission=(5, 5, 5))
    scene = Scene(
        "closed", (*slabs, ball, lamp), {"glossy": glossy, "black": BLACK},
        environment=ConstantEnvironment((1e3,) * 3), cameras=(Camera("door", (-1.5, 0.0, 1.5), (0.5, 0.0, 0.3)),),
    )  # fmt: skip
    store = bake(scene, tmp_path / "s", quality=TINY.changed(probe={"texels": 8}), only=("probe",))
    own = probes_of(store)
    assert own, "some have a probe"
    for name in own:
        array = store.artefact(probe_name(name, "radiance"))
        brightest = float(store.read(array.name).astype(float).max()) * array.meta["unit"]
        assert brightest < 20, f"the probe of {name} shows the sky"


def test_groups_by_hand() -> None:
    """Of four in a row, the second serves its neighbours; the last sees the others too well to lose them."""
    pairs = np.array([(i, j) for i in range(4) for j in range(4) if i != j])
    wrong = np.where(np.abs(pairs[:, 0] - pairs[:, 1]) == 1, 0.1, 0.9)
    none, bare, limits = np.zeros((4, 4)), np.zeros((4, 4)), np.full(4, 0.2)
    assert _grouped(np.arange(4), pairs, wrong, none, none, limits).tolist() == [1, 1, 1, 3]
    lost = none.copy()
    lost[0, 2] = 0.15  # with .1 hidden, above its limit where the third is left out
    assert _grouped(np.arange(4), pairs, wrong, lost, none, limits).tolist() == [0, 2, 2, 2]
    bare[0, 1] = 0.05  # the first would see the sky through the second
    assert _grouped(np.arange(4), pairs, wrong, none, bare, limits).tolist() == [0, 2, 2, 2]


def test_a_damaged_list_of_owners_is_refused(tmp_path: Path) -> None:
    with Store.create(tmp_path / "s", {}) as store:
        store.set_document("shared_probes", {"owners": {"cup": 3}})
        with pytest.raises(UserError, match="shared_probes"):
            shared_probes(store)


def test_a_scene_has_so_many_probes_at_most_those_that_fill_the_view() -> None:
    count = MOST + 6
    worth, size, given = np.arange(count), np.linspace(0.01, 0.02, count), np.zeros(count, bool)
    given[0] = True  # the smallest
    owner = np.arange(count)
    owner[3] = 2  # two objects of one probe fill more than any other
    assert _largest(owner, worth, size, given).tolist() == [0, 2, *range(count - MOST + 2, count)]
    assert len(_largest(owner[:9], worth[:9], size[:9], given[:9])) == 8, "few keep theirs"


def test_objects_beyond_the_most_show_the_nearest_probe(
    table: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lambent.baking.probes.sharing.MOST", 1)
    shutil.copytree(table, tmp_path / "s")
    with Store.open(tmp_path / "s") as kept:
        kept.set_document("shared_probes", {})  # found again
    store = bake_probes(laid_table(), tmp_path / "s")
    (own,) = probes_of(store)
    assert set(shared_probes(store).values()) == {own} and own not in shared_probes(store)


@pytest.mark.long
def test_a_ball_before_a_distant_facade_has_its_own_probe(tmp_path: Path) -> None:
    """Outdoors, most mirrored rays end in the sky, which made a probe 60 m away seem near."""
    ground = patch((-3, 0, 3), (6, 0, 0), (0, 0, -6))
    facade = patch((-100, 0, -60), (200, 0, 0), (0, 60, 0))
    objects = (
        SceneObject("ground", ground, "grey"),
        SceneObject("ball", placed(sphere(0.5, 24, 12), (0.8, 0.5, 0.0)), "mirror"),
        SceneObject("facade", facade, "mirror"),
    )
    mirror = Material(name="mirror", lobes=[Lobe(mx=0.02, my=0.02, r0=(0.9,) * 3, k=(1.0,) * 3)])
    scene = Scene(
        "yard", objects, {"grey": GREY, "mirror": mirror}, ConstantEnvironment((1.0, 1.0, 1.0)),
        cameras=(Camera("front", (0.0, 1.6, 4.0), (0.0, 0.4, 0.0)),),
    )  # fmt: skip
    store = bake_probes(scene, tmp_path / "s")
    assert "ball" in probes_of(store), shared_probes(store)


def test_the_distance_to_far_hits_outdoors_and_indoors() -> None:
    rng = np.random.default_rng(0)
    indoors = rng.uniform(1, 5, (1, 256))
    sky = np.where(np.arange(256) < 150, np.inf, indoors)
    alone = np.where(np.arange(256) < 250, np.inf, indoors)
    on_a_table = np.where(np.arange(256) < 150, 0.05, indoors)
    for inside in (indoors, on_a_table):
        assert _reach(inside, 1000.0) == pytest.approx(np.quantile(inside, 0.75))
    assert _reach(sky, 1000.0) == pytest.approx(4 * np.median(sky[np.isfinite(sky)]), rel=0.05)
    assert _reach(alone, 1000.0) == 1000.0
