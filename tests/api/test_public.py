"""`import lambent`: what is public, that it is lazy, and that functions do what the commands do."""

from __future__ import annotations

import inspect
import subprocess
import sys

import numpy as np
import pytest

import lambent
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe
from lambent.materials.document import Material as Document
from lambent.materials.measured import load
from tests.viewer.editor.measured_specimens import BRASS, write_measurement

HEAVY = ("numpy", "scipy", "mitsuba", "drjit", "wgpu", "imgui_bundle", "matplotlib", "zarr", "numba", "typer", "rich")
# Changing a line here changes what users' scripts rely on: see CONTRIBUTING.md, "Public names".
SIGNATURES = """
bake(scene, folder, *, quality, only, resume, seed, light_map, probes, light_groups, light_fields, light_field_mb,\
 views, session, interreflection, on, note, progress)
check(subject, *, seed, reconstruction, progress, **values)
compare(reference, test)
convert(subject, file, *, as_, reconstruction, progress)
export(store, folder, *, as_, size, views, note, progress)
glare(what, camera, *, threshold_cd_m2, note, progress, **settings)
open(folder)
propose(scene, *, views, session, interreflection, store, progress)
read(file, *, reconstruction, crease_deg)
run_bench(name, *, quick, inputs, output, progress, **sizes)
window(what, mode, *, size, **options)
Comparison.flip
Comparison.psnr_db
Fit.errors
Fit.lambertian_errors
Fit.material
Fit.plots(self, folder, stem)
Fit.report(self, file, *, environment, progress)
Fit.warnings
Material.albedo(self, wo, samples)
Material.curves
Material.eval(self, wi, wo)
Material.facts(self)
Material.name
Material.normalised(self, seed, progress)
Material.pdf(self, wi, wo)
Material.plot(self, file, title)
Material.read(file)
Material.sample(self, wo, u)
Material.save(self, file)
Material.with_curve(self, title, values)
Picture.facts(self)
Picture.read(file)
Picture.save(self, file)
Picture.shown
Scene.cameras
Scene.facts(self)
Scene.materials
Scene.name
Scene.read(file, crease_deg)
Scene.triangles
Store.as_left(self, *, note, progress, **settings)
Store.cameras
Store.edited(self, session, *, surfaces, **settings)
Store.facts(self)
Store.film(self, file, path, *, size, fps, light, variant, keyframes, progress, **settings)
Store.folder
Store.illuminance(self, grid, *, over, height_m, spacing_m, margin_m, light, variant, error, maintenance, progress)
Store.light_groups
Store.light_map(self, file)
Store.materials
Store.relight(self, camera, *, environment, layout, up, scale, turn_deg)
Store.render(self, camera, *, size, integrator, light, edits, variant, exposure_ev, view, note, progress, **settings)
Store.sheet(self, file, camera, *, size, exposures, progress, **settings)
Store.variants
Store.view(self, camera, *, size, light, edits, variant, exposure_ev)
Table.albedo(self, wi)
Table.eval(self, wi, wo)
Table.facts(self)
Table.fit(self, lobes, *, metric, distribution, coupled, keep_albedo, retro, gain, fix, ranges, seed, progress)
Table.name
Table.plot(self, file)
Table.read(file, reconstruction)
Table.samples
View.camera
View.close(self)
View.edits
View.exposure_ev
View.light
View.picture
"""


def _signature(function) -> str:
    words, starred = [], False
    for one in inspect.signature(function).parameters.values():
        if one.kind is one.KEYWORD_ONLY and not starred:
            words.append("*")
            starred = True
        words.append({one.VAR_KEYWORD: "**", one.VAR_POSITIONAL: "*"}.get(one.kind, "") + one.name)
    return ", ".join(words)


def _public() -> list[str]:
    found = []
    for name in lambent.__all__:
        one = getattr(lambent, name)
        if inspect.isfunction(one):
            found.append(f"{name}({_signature(one)})")
        elif inspect.isclass(one) and one is not lambent.UserError:
            for key, value in vars(one).items():
                if key.startswith("_") or (not isinstance(value, property | classmethod) and not callable(value)):
                    continue
                member = getattr(one, key)
                found.append(f"{name}.{key}" + (f"({_signature(member)})" if callable(member) else ""))
    return sorted(found, key=lambda line: (line[0].isupper(), line))


def test_public_names_and_signatures():
    assert _public() == SIGNATURES.strip().splitlines()


def test_every_public_name_says_what_it_does():
    for name in lambent.__all__[1:]:
        one = getattr(lambent, name)
        assert one.__doc__, name
        for key, value in vars(one).items() if inspect.isclass(one) and one is not lambent.UserError else ():
            plain = isinstance(value, property) and key in ("name", "folder", "triangles", "psnr_db")
            if not key.startswith("_") and (callable(value) or isinstance(value, property | classmethod)) and not plain:
                assert inspect.getdoc(getattr(one, key)), f"{name}.{key}"


def test_nothing_heavy_is_loaded_before_it_is_used():
    code = f"import sys, lambent; dir(lambent); print([m for m in {HEAVY} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
    with pytest.raises(AttributeError, match="no attribute 'raed'"):
        lambent.raed  # noqa: B018


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return lambent.read(write_measurement(tmp_path_factory.mktemp("brass") / "brass.txt", BRASS))


@pytest.mark.long
def test_a_table_is_fitted_and_its_material_is_a_bsdf(table, tmp_path):
    assert isinstance(table, lambent.Table) and "isotropic" in repr(table) and "brass.txt" in repr(table)
    said = []
    fit = table.fit(1, progress=lambda done, total, what: said.append(what))
    assert said and fit.errors["cuberoot"] < 0.1 * fit.lambertian_errors["cuberoot"] and "1 lobe" in repr(fit)
    fit.material.save(tmp_path / "brass.json")
    again = lambent.read(tmp_path / "brass.json")
    assert again == fit.material and again.document.provenance.source == "brass.txt"
    wo, u = direction(0.6, 0.2), np.random.default_rng(0).random((7, 3))
    wi = again.sample(np.broadcast_to(wo, (7, 3)), u)
    bsdf = MaterialBSDF(again.document)
    assert np.array_equal(again.eval(wi, wo), bsdf.eval(wi, wo)) and np.array_equal(again.pdf(wi, wo), bsdf.pdf(wi, wo))
    assert again.albedo(wo).shape == (3,)
    assert np.array_equal(table.eval(wi[:1], wo[None]), load(table.file).eval(wi[:1], wo[None]))
    assert again._repr_png_().startswith(b"\x89PNG") and table._repr_png_().startswith(b"\x89PNG")


def test_kinds_are_told_apart_and_facts_are_those_of_inspect(table, tmp_path):
    Document(name="paper", kd=0.7).save(tmp_path / "paper.json")
    lambent.Picture(np.full((4, 6, 3), 0.25, np.float32)).save(tmp_path / "grey.exr")
    kinds = {"paper.json": "material", "grey.exr": "picture"}
    assert {name: lambent.read(tmp_path / name).facts()["is"] for name in kinds} == kinds
    scene = lambent.read("builtin:box")
    assert scene.facts()["objects"] == 8 and "front" in scene.cameras and "white" in scene.materials
    assert table.facts()["is"] == "measured table"
    for name, options in (("paper.json", {"reconstruction": "quadrilinear"}), ("grey.exr", {"crease_deg": 30.0})):
        with pytest.raises(lambent.UserError, match="applies to"):
            lambent.read(tmp_path / name, **options)
    with pytest.raises(lambent.UserError, match=r"none\.txt"):
        lambent.read(tmp_path / "none.txt")


def test_pictures_compare_as_arrays_and_as_files(tmp_path):
    rng = np.random.default_rng(0)
    one = lambent.Picture(rng.random((20, 30, 3)).astype(np.float32), exposure_ev=1.0)
    other = lambent.Picture(one.radiance * np.float32(0.9))
    one.save(tmp_path / "one.exr")
    other.save(tmp_path / "other.exr")
    found = lambent.compare(one, other)
    of_files = lambent.compare(tmp_path / "one.exr", tmp_path / "other.exr")
    assert found.flip > 0 and repr(of_files) == repr(found)
    assert repr(lambent.compare(np.asarray(one), np.asarray(other))) == repr(found)
    assert "FLIP" in repr(found) and "30 x 20, +1.00 EV" in repr(one)
    with pytest.raises(lambent.UserError, match=r"differs in size.*30x19"):
        lambent.compare(one, lambent.Picture(one.radiance[1:]))
    one.save(tmp_path / "one.png")
    shown = lambent.Picture.read(tmp_path / "one.png")
    assert not shown.is_radiance and np.abs(shown.shown.astype(int) - one.shown).max() <= 1


@pytest.mark.long
def test_a_store_is_rendered_with_edits(adapter, baked_box, tmp_path):
    from lambent.render import Settings, still

    store = lambent.open(baked_box)
    assert repr(store).startswith("Store(") and "front" in store.cameras and store.facts()["is"] == "store"
    picture = store.render("front", size=(48, 36), integrator="lamps")
    still(baked_box, tmp_path / "front.exr", "front", Settings(48, 36, "lamps"))
    assert np.allclose(picture.radiance, lambent.Picture.read(tmp_path / "front.exr").radiance, rtol=1e-2, atol=1e-3)
    blue = lambent.Material(Document(name="red", kd=(0.1, 0.1, 0.6), lobes=(Lobe(mx=0.2, my=0.2),)))
    edited = store.render("front", size=(48, 36), integrator="lamps", edits={"red": blue})
    ratio = edited.radiance.mean(axis=(0, 1)) / picture.radiance.mean(axis=(0, 1))
    assert ratio[2] > ratio[0] and lambent.compare(picture, edited).flip > 0.01
    for wrong, message in (
        ({"edits": {"rde": blue}}, "unknown material.*rde.*red"),
        ({"camera": "back"}, "unknown camera.*back"),
        ({"sampels": 3}, "sampels"),
        ({"light": {"lmap": 0.5}}, "unknown light group.*lmap"),
    ):
        with pytest.raises(lambent.UserError, match=message):
            store.render(**{"size": (8, 8), **wrong})


@pytest.mark.long
def test_a_scene_is_baked_and_illuminance_traced(tmp_path):
    store = lambent.bake("builtin:box", tmp_path / "box.store", only={"light_map"}, progress=False)
    assert isinstance(store, lambent.Store) and store.folder == tmp_path / "box.store"
    (floor,) = store.illuminance(over="floor", spacing_m=0.4, margin_m=0.1, error=0.05)
    assert floor.facts()["mean_lx"] > 0 and floor.lx.shape == floor.error_lx.shape
    for wrong, message in (
        ({"over": "flor"}, "flor"),
        ({"over": "floor", "grid": "desk"}, "excludes over"),
        ({"over": "floor", "spacing_m": -1.0}, "spacing_m"),
    ):
        with pytest.raises(lambent.UserError, match=message):
            store.illuminance(**wrong)
