"""Every reader of the project with sound files, and its use: read, and what any program does first with the result."""

from __future__ import annotations

import io
import json
import tempfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image

import lambent
from lambent.core.geometry.directions import direction
from lambent.core.light.colour import luminance
from lambent.core.pictures import exr, rgbe
from lambent.core.pictures.images import read_encoded, read_image
from lambent.editing.session.document import document_from, load_document
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material, Provenance, load_material
from lambent.materials.measured import load
from lambent.materials.measured.inspecting import inspection
from lambent.published.merl_fits import read_fits
from lambent.realtime.light.baked import read_baked
from lambent.scenes.camera_paths import sample_path
from lambent.scenes.loaders.load import formats, load_scene
from lambent.scenes.looks.textures import digest, parts, prepared
from lambent.scenes.reflectors import find_reflectors
from lambent.scenes.scene import ImageEnvironment, MaterialTextures, Scene, Texture
from lambent.scenes.sky.environments import from_lat_long
from lambent.scenes.validation import validate
from lambent.store.contract import SceneRecord, baked_views, scene_record, write_scene_record
from lambent.store.kept.session import read_session, write_session
from lambent.store.kept.views import read_views, with_views
from lambent.store.plans import plan_of
from lambent.store.source import inputs_of
from lambent.store.store import Store
from lambent.store.textures import read_textures, texture_records, write_textures
from tests.materials.measured import sound_files
from tests.reliability import scene_seeds
from tests.viewer.small_store import write_small_store

WI, WO = direction(np.array([0.0, 0.6, 1.2]), 0.3), direction(np.array([0.3, 0.6, 1.4]), 3.4)
MATERIALS_USED = 4  # of a scene: evaluated
Files = dict[str, bytes]


@dataclass(frozen=True)
class Sound:
    """A folder of sound files of which `broken` is the one to break; `use` takes the path of `main`."""

    reader: str
    files: Files
    main: str
    broken: str
    use: Callable[[Path], None]


def numbers_of(reader: str, among: Sequence[Sound]) -> list[int]:
    """Places of the readers whose name holds `reader`; ends the program if there are none."""
    found = [k for k, one in enumerate(among) if reader.lower() in one.reader.lower()]
    if not found:
        raise SystemExit(f"no reader is named {reader!r}: {', '.join(dict.fromkeys(one.reader for one in among))}")
    return found


@cache
def sound() -> tuple[Sound, ...]:
    """A sound folder for every reader and each of its forms."""
    found = [Sound(name, {"a": content}, "a", "a", use_table) for name, contents in sound_files.seeds().items()
             for content in contents]  # fmt: skip
    factors = _factors()
    found += [Sound("homomorphic factors", factors, "alpha", file, use_table) for file in factors]
    found += [_alone("material document", _material(), use_material), _alone("published fits", _fits(), use_fits)]
    found += [_alone("session.json", _session(), use_session), _alone("session of edits", _edits(), use_edits)]
    found += [_alone(name, content, use_picture) for name, content in _pictures().items()]
    scenes = {
        "glTF 2.0": [("scene.gltf", scene_seeds.gltf("inside")), ("scene.gltf", scene_seeds.gltf("beside"))],
        "glTF 2.0, GLB": [("scene.glb", scene_seeds.gltf("glb"))],
        "Wavefront OBJ": [("scene.obj", scene_seeds.obj())],
        "PLY": [("scene.ply", scene_seeds.ply(f)) for f in ("ascii", "binary_little_endian", "binary_big_endian")],
        "Bezier patches": [("scene.bpt", scene_seeds.bpt(numbered)) for numbered in (False, True)],
        "Mitsuba XML": [("scene.xml", scene_seeds.mitsuba())],
        "scene.toml": [("scene.toml", scene_seeds.toml(_material(), sound_files.seeds()["gonio text"][0]))],
    }
    found += [Sound(name, files, main, main, use_scene) for name, folders in scenes.items() for main, files in folders]
    within = {
        "scene.obj": {"MTL": "a.mtl"},
        "scene.xml": {
            "Mitsuba XML, included": "inner.xml",
            "serialized mesh": "a.serialized",
            "spectrum file": "a.spd",
            "lat-long HDR": "sky.hdr",
        },
        "scene.toml": {
            "material of a scene": "copper.json",
            "IES photometry": "lamp.ies",
            "IES photometry, type B": "flood.ies",
            "tilt file": "flood.tlt",
            "EULUMDAT": "lamp.ldt",
        },
    }
    for one in [s for s in found if s.main in within]:
        files = one.files | ({"scene.xml": scene_seeds.PLAIN_MITSUBA} if one.main == "scene.xml" else {})
        found += [Sound(name, files, one.main, file, use_scene) for name, file in within[one.main].items()]
    for name, content in scene_seeds.pictures().items():
        found.append(Sound(name, scene_seeds.obj() | {"p.png": content}, "scene.obj", "p.png", use_scene))
    store = _store()
    chunk = next(name for name in store if name.startswith("light_map/irradiance/c/"))
    stores = {"store manifest": "manifest.json", "store chunk": chunk, "views.json": "views.json",
              "store journal": "geometry/faces/journal"}  # fmt: skip
    found += [Sound(name, store, "", file, use_store) for name, file in stores.items()]
    return tuple(found)


def _factors() -> Files:
    """The scales of homomorphic factors, and their two textures."""
    across = np.linspace(0.1, 0.9, 16)
    texels = np.round(255 * np.stack([np.add.outer(across, across) / 2] * 3, axis=-1)).astype(np.uint8)
    stream = io.BytesIO()
    Image.fromarray(texels).save(stream, "PNG")
    return {"alpha": b"0.5\n.25\n1e-1\n", "velvetp.png": stream.getvalue(), "velvetq.png": stream.getvalue()}


def scene_formats() -> set[str]:
    """Names of the formats of scenes that are found in the package."""
    return {module.NAME for module in formats()}


def _alone(reader: str, content: bytes, use: Callable[[Path], None]) -> Sound:
    return Sound(reader, {"a": content}, "a", "a", use)


def _material() -> bytes:
    lobes = (Lobe(mx=0.1, my=0.3, r0=(0.5, 0.4, 0.3)), Lobe(side="transmission", distribution="ggx", mx=0.2, my=0.2))
    account = Provenance(source="a.bsdf", method="fit", metric="cosine", errors={"cosine": 0.1}, samples={"used": 3})
    material = Material(name="copper", kd=0.2, kd_coupled=True, kt_d=0.1, lobes=lobes, provenance=account)  # type: ignore[arg-type]
    return json.dumps(material.model_dump(mode="json")).encode()


def _fits() -> bytes:
    kd = "Lambertian(albedo = [.1, .2, 3e-1])"
    return f"""# made up
a = Aggregate({kd}, NganWard(albedo = [.01, .02, .03], roughness = .1))
b = Aggregate({kd}, NganCookTorrance(albedo = [1, 1, 1], roughness = .2, eta = .04))
c = Aggregate({kd}, LowCookTorrance(albedo = [1, 1, 1], roughness = .2, eta = 1.5))
""".encode()


def _edits() -> bytes:
    material = json.loads(_material())
    camera = {"name": "a", "position": [0, 1, 0], "target": [0, 1, -1], "up": [0, 1, 0], "fov_y_deg": 45}
    return json.dumps({
        "format": "lambent-edit-session", "version": 2, "scene": "room.store", "camera": camera, "size": [64, 48],
        "environment": {"file": "sky.hdr", "scale": 2, "rotation_deg": 30}, "merged": {"wall": "plaster"},
        "materials": {"copper": {"start": material, "now": material | {"kd": 0.3}}}, "crease_deg": 40,
    }).encode()  # fmt: skip


def _session() -> bytes:
    edits, material = json.loads(_edits()), json.loads(_material())
    room = {
        "materials": {"copper": material}, "textures": {"copper": "", "floor": "copper"},
        "light": {"groups": {"sun": {"on": True, "intensity": 1.5, "temperature_k": 3000.0}}},
        "lamps": {"0": {"position": [0, 2, 0], "aim": [0, -1, 0], "rotation_deg": 20}},
    }  # fmt: skip
    view = {"camera": edits["camera"], "speed_m_s": 1.5, "look": {"exposure_ev": 3, "lookups": {"ball": "auto"}}}
    return json.dumps({
        "format": "lambent-walk-session", "version": 2, "now": room, "beside": room, "states": {"evening": room},
        "view": view, "edited": {"a": {"document": edits, "shown": ["copper"]}}, "sky": {"turn_deg": 90},
    }).encode()  # fmt: skip


def _pictures() -> dict[str, bytes]:
    image = np.random.default_rng(0).random((6, 9, 3)).astype(np.float32)
    with tempfile.TemporaryDirectory() as folder:
        exr.encode(image, Path(folder) / "a.exr")
        found = {"EXR": (Path(folder) / "a.exr").read_bytes()}
    found |= {"Radiance HDR": rgbe.encode(image), "Radiance HDR, run lengths": _run_lengths()}
    return found | {"PNG": scene_seeds.encoded("PNG"), "JPEG": scene_seeds.encoded("JPEG")}


def _run_lengths() -> bytes:
    row = b"\x02\x02\x00\x10" + b"".join(bytes([0x80 + 12, v, 4, 1, 2, 3, v]) for v in (9, 80, 200, 128))
    return b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 3 +X 16\n" + row * 3


def _store() -> Files:
    with tempfile.TemporaryDirectory() as name:
        folder = write_small_store(Path(name) / "s")
        with Store.create(folder, {"scene": "x"}) as store:
            texture = Texture(np.random.default_rng(0).random((4, 4, 3)).astype(np.float16))
            textures = {"brass": MaterialTextures(diffuse=texture)}
            record = scene_record(store)
            write_scene_record(store, record.model_copy(update={"textures": texture_records(textures)}))
            write_textures(store, textures)
        found = {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
    a = {"name": "a", "position": [0, 1, 0], "target": [0, 1, -1], "up": [0, 1, 0], "fov_y_deg": 45}
    path = {"name": "w", "keys": [a, a | {"position": [2, 1, 0]}], "seconds": 3, "times_s": [0, 3]}
    views = {"format": "lambent-views", "version": 1, "cameras": [a], "paths": [path]}
    found["views.json"] = json.dumps(views).encode()
    crc = json.loads(found["manifest.json"])["artefacts"]["geometry/faces"]["done"]["0.0"]
    found["geometry/faces/journal"] = f"\n0.0 0 {crc};\nlength 3 0;".encode()
    return {name: content for name, content in found.items() if "lock" not in name}


def use_table(path: Path) -> None:
    table = load(path)
    f = table.eval(WI, WO)
    assert np.isfinite(f).all() and (f >= 0).all(), "eval is not finite or negative"
    assert np.isfinite(table.reflectivity(WI[:1])).all(), "reflectivity is not finite"
    samples = table.samples(1000)
    assert np.isfinite(samples.f).all() and (samples.weight >= 0).all(), "samples are not finite"
    if _chosen(path.read_bytes()):
        json.dumps(inspection.inspect_table(table), default=str).encode()


def _chosen(content: bytes) -> bool:
    """Whether slow uses of a file are tried: those of one file in eight, and always the same ones."""
    return zlib.crc32(content) % 8 == 0


def use_material(path: Path) -> None:
    material = load_material(path)
    _evaluate(material)
    material.save(path.with_name("saved"))
    assert load_material(path.with_name("saved")) == material, "saved, it reads otherwise"


def _evaluate(material: Material) -> None:
    bsdf = MaterialBSDF(material)
    assert np.isfinite(bsdf.eval(WI, WO)).all() and np.isfinite(bsdf.pdf(WI, WO)).all(), "f is not finite"
    assert np.isfinite(bsdf.albedo(WO[:1], 16)).all(), "albedo is not finite"


def use_fits(path: Path) -> None:
    for one in read_fits(path).values():
        assert np.isfinite(one.eval(WI, WO)).all(), "f is not finite"


def use_session(path: Path) -> None:
    session = read_session(path)
    assert session is not None
    for room in session.rooms:
        assert np.isfinite(list(room.light.factors.values()) or 0).all(), "a mix is not finite"
        for material in list(room.materials.values())[:MATERIALS_USED]:
            _evaluate(material)
    session.unknown({"copper"}, {"sun"})
    for one in session.edited.values():
        document_from(one.document, path)
    write_session(path.with_name("saved"), session)
    assert read_session(path.with_name("saved")) == session, "saved, it reads otherwise"


def use_edits(path: Path) -> None:
    document = load_document(path)
    for one in list(document.materials.values())[:MATERIALS_USED]:
        _evaluate(one.start)
        _evaluate(one.now)


def use_picture(path: Path) -> None:
    image = read_image(path)
    assert np.isfinite(luminance(image).mean(dtype=float)), "luminance is not finite"
    from_lat_long(image, 4)
    del image  # the other way to read it has the memory for itself
    if path.read_bytes()[:1] in (b"\x89", b"\xff"):
        read_encoded(path)


def use_scene(path: Path) -> None:
    scene = load_scene(path)
    _check(scene)
    inputs_of(scene)
    validate(scene)
    if len(scene.objects) < 16 and _chosen(b"".join(o.mesh.positions.tobytes() for o in scene.objects)):
        find_reflectors(scene)
    for of_material in prepared(scene.textures).values():
        for texture in parts(of_material).values():
            digest(texture)
    for material in list(scene.materials.values())[:MATERIALS_USED]:
        _evaluate(material)
    for one in scene.paths:
        sample_path(one, 0.3)
    if isinstance(scene.environment, ImageEnvironment):
        from_lat_long(read_image(scene.environment.file), 4)
    for table in scene.measured.values():
        load(table).eval(WI, WO)


def _check(scene: Scene) -> None:
    for o in scene.objects:
        m = o.mesh
        assert all(np.isfinite(a).all() for a in (m.positions, m.normals, m.tangents, m.uv)), "a mesh is not finite"
        assert int(m.faces.max()) < len(m.positions), "a face leads nowhere"
    names = [*(o.name for o in scene.objects), *scene.materials, *(c.name for c in scene.cameras), *scene.warnings]
    "".join(names).encode()
    assert len({o.name for o in scene.objects}) == len(scene.objects), "two objects have the same name"


def use_store(folder: Path) -> None:
    """Everything that the window, the renderer and `lambent inspect` read of a store."""
    store = Store.open(folder)
    record: SceneRecord = with_views(scene_record(store), read_views(folder))
    for artefact in store.artefacts():
        store.read_partial(artefact.name)
        if artefact.complete:
            store.read(artefact.name)
    read_textures(store, record)
    baked_views(store)
    for reflector in record.reflectors:
        if reflector.plan is not None:
            plan_of(reflector.plan)
    for path in record.paths:
        sample_path(path, 0.3)
    for material in list(record.materials.values())[:MATERIALS_USED]:
        _evaluate(material)
    read_baked(store)
    json.dumps(lambent.open(folder).facts(), default=str)
