"""`lambent inspect`: the kind of a file, and a summary of its contents."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from lambent.cli.console import Between, CreaseAngle, Force, Json, show, table, words
from lambent.cli.materials.convert import is_document
from lambent.core.errors import UserError
from lambent.core.inputs import read_head
from lambent.core.plain import plain

ALBEDO_AT_DEG = (0, 30, 60)
HEAD_BYTES = 1 << 16  # a Mitsuba scene identifies itself within these
PICTURES = (b"v/1\x01", b"#?RADIANCE", b"#?RGBE", b"\x89PNG", b"\xff\xd8\xff")
Facts = dict[str, Any]


def command(
    file: Annotated[
        str, typer.Argument(help="Measured table, material, luminaire, scene, store, image; or builtin:room.")
    ],
    plot: Annotated[Path | None, typer.Option(help="Plot a table, material or luminaire (.png, .pdf, .svg).")] = None,
    reconstruction: Between = "auto",
    crease_angle: CreaseAngle = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Describe a file of Lambent or of another tool: format, dimensions, symmetry, albedo, faults.

    Example: lambent inspect brushed.bsdf --plot brushed.png
    """
    if plot is not None:
        from lambent.core.outputs import check_output

        check_output(plot, (".png", ".pdf", ".svg"), force=force, inputs=[file])
    inspect = inspector_of(file)
    if reconstruction != "auto" and inspect is not inspect_table:
        raise UserError("applies to measured tables only", file=file, field="--reconstruction")
    if crease_angle is not None and inspect is not inspect_scene:
        raise UserError("applies to scenes only", file=file, field="--crease-angle")
    if plot is not None and inspect not in (inspect_table, inspect_material, inspect_luminaire):
        raise UserError("applies to tables, materials and luminaires only", file=file, field="--plot")
    own = {inspect_table: (plot, reconstruction), inspect_scene: (crease_angle,)}
    facts = plain(inspect(file, *own.get(inspect, (plot,) if plot is not None else ())))
    prose = ["\n- ".join([f"\n\n{name}", *value]) for name, value in facts.items() if _is_prose(value)]
    show(facts, table(_rows(facts)) + "".join(prose), json)


def inspector_of(file: str) -> Callable[..., Facts]:
    """The function that describes a file, chosen by its path and its first bytes."""
    from lambent.scenes.loaders.load import BUILTIN_PREFIX, is_scene
    from lambent.scenes.photometry.files import is_luminaire

    path = Path(file)
    if file.startswith(BUILTIN_PREFIX):
        return inspect_scene
    if path.is_dir():
        return inspect_store
    head = read_head(path, HEAD_BYTES)
    if head.startswith(PICTURES):
        return inspect_picture
    if is_scene(path, head):
        return inspect_scene
    if is_document(head):
        return inspect_material
    return inspect_luminaire if is_luminaire(path, head) else inspect_table


def inspect_table(file: str, plot: Path | None = None, reconstruction: Between = "auto") -> Facts:
    """A measured table: its description, usable share, albedo and faults."""
    from lambent.materials import measured
    from lambent.materials.measured.inspecting import inspection

    measurement = measured.load(Path(file), reconstruction)
    if plot is not None:
        from lambent.materials.plots import plot_measurement

        plot_measurement(plot, measurement, title=Path(file).name)
    facts = inspection.inspect_table(measurement)
    return {"is": "measured table", **facts, "findings": facts["findings"] or ["no faults found"]}


def inspect_material(file: str, plot: Path | None = None) -> Facts:
    """A material document: its numbers, its albedo, its source."""
    import numpy as np

    from lambent.core.geometry.directions import direction
    from lambent.materials.bsdf import MaterialBSDF
    from lambent.materials.document import load_material

    material = load_material(Path(file))
    bsdf = MaterialBSDF(material)
    if plot is not None:
        from lambent.materials.plots import plot_plane_of_incidence

        plot_plane_of_incidence(plot, bsdf.eval, material.name, title=Path(file).name, transmits=material.transmits)
    albedo = bsdf.albedo(direction(np.radians(ALBEDO_AT_DEG), 0.0))
    provenance = material.provenance.model_dump(mode="json") if material.provenance else {}
    return {
        "is": "material",
        "name": material.name,
        "kd": material.kd,
        "kt_d": material.kt_d,
        **{f"lobe {number}": lobe.model_dump() for number, lobe in enumerate(material.lobes, 1)},
        "albedo": {f"{angle} deg": float(rgb.mean()) for angle, rgb in zip(ALBEDO_AT_DEG, albedo, strict=True)},
        "source": {key: value for key, value in provenance.items() if value and not isinstance(value, dict | list)},
        "errors": provenance.get("errors"),
        "notes": provenance.get("notes"),
    }


def inspect_luminaire(file: str, plot: Path | None = None) -> Facts:
    """A photometric file: the luminaire, its flux and angles, and faults."""
    from lambent.scenes.photometry.files import read_luminaire
    from lambent.scenes.photometry.inspection import facts_of, plot_polar

    luminaire = read_luminaire(Path(file))
    if plot is not None:
        plot_polar(plot, luminaire)
    return {"is": "luminaire", **facts_of(luminaire)}


def inspect_scene(file: str, crease_deg: float | None = None) -> Facts:
    """A scene: its contents, and the repairs of its loader."""
    from lambent.scenes import load_scene
    from lambent.scenes.light_groups import groups_before_bake
    from lambent.scenes.scene import SunSky
    from lambent.scenes.sky.clear_sky import daylight_in_words

    scene = load_scene(file, crease_deg)
    low, high = scene.bounds
    return {
        "is": "scene",
        "name": scene.name,
        "objects": len(scene.objects),
        "triangles": sum(len(o.mesh.faces) for o in scene.objects),
        "materials": sorted(scene.materials),
        "environment": type(scene.environment).__name__ if scene.environment else "none",
        **({"daylight": daylight_in_words(scene.environment)} if isinstance(scene.environment, SunSky) else {}),
        "lights": len(scene.lights) + sum(any(o.emission) and o.luminaire is None for o in scene.objects),
        "light_groups": {group.name: ", ".join(group.members) for group in groups_before_bake(scene)},
        "variants": _variants(scene.variants),
        "cameras": [camera.name for camera in scene.cameras],
        "paths": [path.name for path in scene.paths],
        "size_m": (high - low).round(3),
        "warnings": scene.warnings,
    }


def inspect_store(file: str) -> Facts:
    """A store: its arrays, complete or not, and whether every chunk on disk is sound."""
    from lambent.store.contract import SCENE
    from lambent.store.kept.states import variants_of
    from lambent.store.light_groups import light_groups
    from lambent.store.store import Store

    store = Store.open(Path(file))
    return {
        "is": "store",
        "arrays": {a.name: f"{'x'.join(map(str, a.shape))} {a.dtype}, {_health(store, a)}" for a in store.artefacts()},
        "documents": sorted(store.documents),
        "light_groups": {g.name: f"{g.share:.1%} of the light: {', '.join(g.members)}" for g in light_groups(store)},
        "variants": _variants(variants_of(store) if SCENE in store.documents else ()),
        "reflectors": _reflectors(store),
        "inputs": store.inputs,
    }


def _variants(variants: Iterable[Any]) -> dict[str, str]:
    """Changes of each variant: materials and light groups."""
    found = {}
    for one in variants:
        changed = [", ".join(one.looks)] * bool(one.looks)
        changed += [f"light of {', '.join(one.light.groups)}"] * bool(one.light.groups)
        found[one.name] = "; ".join(changed) or "as baked"
    return found


def _reflectors(store: Any) -> list[str]:
    """Planar reflectors in words: area, objects, plane."""
    from lambent.store.contract import SCENE, scene_record

    words = []
    for r in scene_record(store).reflectors if SCENE in store.documents else ():
        *n, d = (round(x, 3) + 0.0 for x in r.plane)
        area = sum(part.area_m2 for part in r.parts)
        words.append(f"{area:.2f} m2 of {', '.join(part.object for part in r.parts)}: n {n}, d {d}")
    return words


def inspect_picture(file: str) -> Facts:
    """An image: size and range of its linear values."""
    from lambent.core.light.colour import luminance
    from lambent.core.pictures.images import read_image

    image = read_image(Path(file))
    return {
        "is": "picture",
        "size": [image.shape[1], image.shape[0]],
        "luminance_mean": float(luminance(image).mean()),
        "lowest": float(image.min()),
        "highest": float(image.max()),
        "mean_rgb": image.mean(axis=(0, 1), dtype=float),
    }


def _health(store: Any, artefact: Any) -> str:
    if not artefact.complete:
        return str(artefact.state)
    try:
        store.read(artefact.name)
    except UserError as error:
        return error.message
    return "complete"


def _rows(facts: Facts, indent: str = "") -> Iterator[tuple[str, str]]:
    """(name, words) of every non-empty fact; nested facts are indented."""
    for name, value in facts.items():
        label = indent + name
        if isinstance(value, dict) and value:
            yield label, ""
            yield from _rows(value, indent + "  ")
        elif value not in ([], {}, None) and not _is_prose(value):
            yield label, _words(value)


def _is_prose(value: Any) -> bool:
    """Whether a fact is a list of sentences, which are printed below the table."""
    return isinstance(value, list) and bool(value) and all(isinstance(item, str) and " " in item for item in value)


def _words(value: Any) -> str:
    if not isinstance(value, list):
        return words(value)
    nested = any(isinstance(item, list) for item in value)
    return ("; " if nested else " " if isinstance(value[0], float) else ", ").join(map(_words, value))
