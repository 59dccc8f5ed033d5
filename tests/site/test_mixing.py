"""Light groups in a site: mixes against the native renderer's, sliders, and what a site holds for them."""

from __future__ import annotations

import base64
import json
from types import SimpleNamespace

import numpy as np
import pytest

import lambent
from lambent.core.light.light_mix import LEAST_K, MOST_K, GroupMix, MixTrack
from lambent.core.pictures.metrics import flip
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.render.applied_materials import AppliedMaterials
from lambent.site.mixing import Mixing
from lambent.store.kept.states import variants_of
from lambent.store.light_groups import light_groups
from lambent.store.store import Store
from tests.site.conftest import served
from tests.site.lit_scene import CAMERAS, EVENING, bake_lit_store
from tests.site.test_export import manifest_of, unpacked
from tests.site.test_page_modules import said

SIZE = 96, 64
PERCENT = (100, 100, 100, 35), (0, 100, 0, 0), (0, 100, 100, 100), (195, 12, 130, 9)  # of sun, sky, spot and lüstre
PICTURES = """async ([cameras, mixes, width, height]) => {
  const { readManifest, Data } = await import("/loading.js");
  const { Frame } = await import("/frame.js"), { openDevice } = await import("/device.js");
  const { Mixing, factorOf } = await import("/mixing.js");
  const manifest = await readManifest(), device = await openDevice(manifest), faults = [];
  device.addEventListener("uncapturederror", (event) => faults.push(event.error.message));
  const data = new Data(() => {}), text = (bytes) => btoa(String.fromCharCode(...bytes));
  const frame = await Frame.open(manifest, device, document.createElement("canvas"), data), { objects } = frame;
  frame.resize(width, height);
  const mixing = new Mixing(manifest, objects, data);
  objects.leave = () => mixing.leave();
  const found = [], maps = [], times = [];
  const { texture: at, layers } = manifest.states[0].mixing.textures[0];
  const [columns, rows] = manifest.tables.texture[at].size;
  for (const [state, mix] of mixes) {
    const own = manifest.states[state].mixing.light.map((one) => factorOf(one, manifest.blackBodies));
    if (state !== mixing.state) {
      await frame.show(state, data);
      mixing.take(state, own);
      mixing.state = state;
    }
    const factors = mix ?? own;
    await mixing.load(factors.flatMap((factor, i) => (String(factor) === String(own[i]) ? [] : [i])));
    await device.queue.onSubmittedWorkDone();
    const start = performance.now();
    mixing.mix(factors, true);
    await device.queue.onSubmittedWorkDone();
    times.push(performance.now() - start);
    for (const camera of cameras) found.push(text(await frame.pixels(camera, "plain")));
    const bytesPerRow = Math.ceil(columns / 32) * 256, size = bytesPerRow * rows * layers;
    const buffer = device.createBuffer({ size, usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ });
    const encoder = device.createCommandEncoder(), texture = objects.made.texture[at];
    encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow, rowsPerImage: rows }, [columns, rows, layers]);
    device.queue.submit([encoder.finish()]);
    await buffer.mapAsync(GPUMapMode.READ);
    const all = new Uint8Array(buffer.getMappedRange()), map = [];
    for (let row = 0; row < rows * layers; row++) {
      map.push(text(all.subarray(row * bytesPerRow, row * bytesPerRow + columns * 8)));
    }
    maps.push(map);
  }
  return { faults, found, maps, times };
}"""


@pytest.fixture(scope="session")
def lit(mi, adapter, tmp_path_factory):
    """A store with light groups and two states, and its site."""
    folder = tmp_path_factory.mktemp("lit")
    store = bake_lit_store(folder / "lit.store")
    made = lambent.export(store, folder / "site")
    return SimpleNamespace(store=store, site=folder / "site", made=made, manifest=manifest_of(folder / "site"))


@pytest.mark.parametrize(
    "mix", [GroupMix(), GroupMix(intensity=0.3), GroupMix(on=False), GroupMix(intensity=2.0, temperature_k=LEAST_K),
            GroupMix(temperature_k=MOST_K, colour=(0.2, 0.5, 1.0)), GroupMix(temperature_k=2712.0)],
)  # fmt: skip
def test_factors_are_those_of_python(javascript, mix):
    one = {"intensity": mix.intensity if mix.on else 0, "kelvin": mix.temperature_k, "colour": mix.colour}
    bodies = Mixing.said.func(SimpleNamespace(names=[]))["blackBodies"]
    found = javascript("import {factorOf} from './mixing.js'; say(factorOf(...given));", [one, bodies])
    assert found == pytest.approx(mix.factor, rel=5e-4, abs=1e-4)


def test_numbers_are_sums_by_group_and_channel(javascript):
    rng = np.random.default_rng(1)
    parts, factors = rng.normal(size=(4, 3, 5)).astype(np.float32), rng.uniform(0, 2, (4, 3))
    table = np.concatenate([np.zeros((1, 5), np.float32), parts.reshape(12, 5)]).ravel().tolist()
    code = """import {mixedNumbers} from './mixing.js';
    say(Array.from(mixedNumbers(Float32Array.from(given[0]), given[1])));"""
    found = javascript(code, [table, factors.tolist()])
    np.testing.assert_array_equal(np.float32(found), np.einsum("gc,gck->k", factors, parts).astype(np.float32))


def test_a_site_without_groups_holds_nothing_for_them(box_site):
    manifest = manifest_of(box_site)
    assert not {"lightGroups", "blackBodies"} & manifest.keys()
    assert all("mixing" not in state for state in manifest["states"])
    assert not any(one["usage"] & 0x8 for one in manifest["tables"]["texture"]), "no texture is written to"


def halves(site, piece, size) -> np.ndarray:
    return np.frombuffer(unpacked(site, piece), np.float16).astype(np.float32).reshape(size)


@pytest.mark.long
def test_parts_add_up_to_each_state_as_exported(lit):
    """Of textures and numbers, in the store's light, with red walls, and in the evening."""
    names = lit.manifest["lightGroups"]
    assert names == [group.name for group in light_groups(Store.open(lit.store))] and len(names) == 4
    light = {"as baked": {}, "red": {}, "evening": MixTrack.of(EVENING).factors_at(0.0)}
    for state in lit.manifest["states"]:
        factors = np.array([light[state["name"]].get(name, (1, 1, 1)) for name in names], np.float32)
        assert len(state["mixing"]["textures"]) > 3, "light map, skies and probes"
        for one in state["mixing"]["textures"]:
            at, table = one["texture"], lit.manifest["tables"]["texture"][one["texture"]]
            piece = state["changes"].get("texture", {}).get(str(at), table["data"])
            own, sums = halves(lit.site, piece, -1), 0.0
            for part, factor in zip(one["pieces"], factors, strict=True):
                if part is not None:
                    sums = sums + halves(lit.site, part, (-1, 4)) * [*factor, 0]
            own = own.reshape(-1, 4)[: len(sums), :3]
            error = np.abs(np.maximum(sums[:, :3], 0) - own)
            most = np.quantile(error, 0.999)  # texels about the sun's disc differ in the store
            assert most <= 5e-3 * own.max() and error.mean() <= 1e-3 * own.mean(), (state["name"], at)
        data = np.frombuffer(unpacked(lit.site, state["mixing"]["numbers"]), np.float32)
        own, parts = (rows := data.reshape(1 + 3 * len(names), -1))[0], rows[1:].reshape(len(names), 3, -1)
        assert sum(count for _, _, count in state["mixing"]["spans"]) == len(own) > 50
        np.testing.assert_allclose(
            np.einsum("gc,gck->k", factors, parts), own, rtol=5e-3, atol=1e-3 * np.abs(own).max()
        )


@pytest.mark.long
def test_mixes_are_those_of_the_native_renderer(chromium, device, lit):
    """Four mixes, among them a group alone, and all but one; the same with red walls; the evening, and back."""
    store = Store.open(lit.store)
    renderer = Renderer(device, store)
    names = lit.manifest["lightGroups"]
    mixes = [(np.array(percent) / 100).repeat(3).reshape(-1, 3).tolist() for percent in PERCENT]
    asked = [(0, None), *((0, mix) for mix in mixes), (1, mixes[3]), (2, None), (2, mixes[3]), (0, None)]
    with chromium(bypass_csp=True) as page, served(lit.site) as address:
        page.goto(f"{address}site.css")
        answer = page.evaluate(PICTURES, [[said(camera) for camera in CAMERAS], asked, *SIZE])
    assert answer["faults"] == []
    assert answer["maps"][0] == answer["maps"][-1], "back in the light as exported, to the bit"
    found, applied = iter(answer["found"]), AppliedMaterials(store, renderer, lambda text: None)
    variants = [None, *variants_of(store)]
    for state, mix in asked:
        variant = variants[state]
        applied.apply(variant.looks if variant else {}, {}, {})
        own = MixTrack.of(variant.light).factors_at(0.0) if variant else {}
        light = own if mix is None else {name: tuple(factor) for name, factor in zip(names, mix, strict=True)}
        for camera in CAMERAS:
            shown = np.frombuffer(base64.b64decode(next(found)), np.uint8).reshape(SIZE[1], SIZE[0], 4)[..., :3]
            frame = FrameState(
                camera, *SIZE, exposure_ev=lit.manifest["exposureEv"], materials=applied.materials,
                maps=renderer.light_version, light=light,
            )  # fmt: skip
            native = renderer.display_image(frame)
            assert native.std() > 10, f"{camera.name} shows something"
            assert np.abs(shown.astype(float) - native).mean() < 0.5, (state, mix, camera.name)
            assert flip(native / 255, shown / 255).mean < 0.02, (state, mix, camera.name)
    loaded: set[int] = set()
    for mix, rows in zip(mixes, answer["maps"][1:], strict=False):
        loaded |= {group for group, factor in enumerate(mix) if factor != [1, 1, 1]}
        assert_is_sum(lit, mix, loaded, b"".join(map(base64.b64decode, rows)))


def assert_is_sum(lit, mix, loaded: set[int], content: bytes) -> None:
    """Every half float of a mixed light map is the sum, or beside it; with what was exported until all are loaded."""
    one = lit.manifest["states"][0]["mixing"]["textures"][0]
    own = halves(lit.site, lit.manifest["tables"]["texture"][one["texture"]]["data"], (-1, 4))
    parts, keeps = [halves(lit.site, part, (-1, 4)) for part in one["pieces"]], len(loaded) < len(one["pieces"])
    total = own[: len(parts[0])] * [keeps, keeps, keeps, 1]
    for group in loaded:
        total += parts[group] * [*(np.float32(mix[group]) - keeps), 0]
    wanted = np.clip(total, 0, 65504).astype(np.float16).view(np.int16).astype(int)
    assert np.abs(np.frombuffer(content, np.int16).reshape(-1, 4) - wanted).max() <= 1


@pytest.mark.long
def test_sliders(chromium, lit):
    """By keys and reset; parts are fetched at the first move; states set them."""
    with chromium() as page, served(lit.site) as address:
        faults, asked = [], set()
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on("request", lambda request: asked.add(request.url.removeprefix(address)))
        page.goto(address)
        page.wait_for_selector("body[data-frames]", state="attached")
        parts = {p["file"] for one in lit.manifest["states"][0]["mixing"]["textures"] for p in one["pieces"] if p}
        of_baked = {one["data"]["file"] for one in lit.manifest["tables"]["texture"] if "data" in one}
        assert not (parts - of_baked) & asked, "nothing is fetched before a slider moves"
        page.click("#light summary")
        assert page.locator("#light legend").all_inner_texts() == lit.manifest["lightGroups"]
        slider = page.get_by_label("lüstre: brightness")
        assert slider.get_attribute("aria-valuetext") == "100 %"
        slider.press("ArrowLeft")
        page.wait_for_selector('body[data-light*="0.99"]', state="attached")
        assert json.loads(page.get_attribute("body", "data-light")) == {"lüstre": 0.99}
        assert slider.get_attribute("aria-valuetext") == "99 %"
        fetched = {p["file"] for one in lit.manifest["states"][0]["mixing"]["textures"] if (p := one["pieces"][3])}
        assert fetched <= asked and not (parts - fetched - of_baked) & asked, "of this group alone"
        page.get_by_label("lüstre: colour temperature").first.check()
        page.wait_for_selector('body[data-light*="6500"]', state="attached")
        slider.dblclick()
        page.wait_for_selector('body[data-light="{}"]', state="attached")
        page.click("#states button >> text=evening")
        page.wait_for_selector("body[data-state='evening']", state="attached")
        assert [slider.input_value(), page.get_by_label("sky: brightness").input_value()] == ["150", "25"]
        page.get_by_label("sky: brightness").press("Home")
        page.wait_for_selector("body[data-light*='\"sky\":0']", state="attached")
        page.click("#light button")
        page.wait_for_selector('body[data-light="{}"]', state="attached")
        assert page.get_by_label("sky: brightness").input_value() == "25"
        slider.press("ArrowRight")
        page.wait_for_selector('body[data-light*="1.51"]', state="attached")
        page.click("#share")
        shared = page.url
        page.click("#states button >> text=as baked")
        page.wait_for_selector('body[data-state="as baked"]', state="attached")
        assert slider.input_value() == "100"
        page.goto("about:blank")
        page.goto(shared)
        page.wait_for_selector('body[data-light*="1.51"]', state="attached")
        pressed = page.get_attribute("#states button >> text=evening", "aria-pressed")
        assert pressed == "true" and slider.input_value() == "151" and faults == []
