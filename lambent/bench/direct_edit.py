"""`direct-edit`: editing the materials of a view, from the bake to the frame, against path tracing with a denoiser.

A row is a scene with a number of lights, baked separately into an empty store with compiled kernels. Frames are those
of a drag, with `show`, `step` and `image`: a soft pull of the highlight's first node, which brightens the middle of the
highlight by 2 % of its value a frame, and leaves its rim. The row `full frame` has synthetic transport of 256 bands in
every pixel. Errors are those of a picture after an edit that a material document can also express, so that the path
tracer can draw it: `flip` and `rival_flip` are means over pixels with surfaces, against its converged picture of direct
light. `rival_seconds` is the time of path tracing, guides and Open Image Denoise with the fewest samples, in powers of
two, that match the error of the edited picture. `reference_flip` is between two halves of the reference's samples.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import count, islice
from pathlib import Path
from typing import Any

import numpy as np

from lambent.baking.bake import bake
from lambent.baking.quality import quality_named
from lambent.baking.transport.view import View
from lambent.bench.measuring.reference import Reference, path_traced
from lambent.bench.measuring.sum_over_lights import errors_of_sums
from lambent.core.arrays import Flags, Floats
from lambent.core.files import folder_bytes
from lambent.core.pictures.metrics import display_exposure, displayed
from lambent.core.plain import triple
from lambent.core.progress import Progress, silent, tracked
from lambent.editing.curves.nodes import Which, pulled, values_of, with_lobe, with_values
from lambent.editing.picture import EditedPicture, Part
from lambent.editing.rows import Rows
from lambent.editing.session.session import Session
from lambent.editing.stored import edited_picture
from lambent.materials.document import Material
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Scene
from lambent.store.contract import view_artefact_name
from lambent.store.store import Store

NAME = "direct-edit"
MIB = 2**20
BANDS = 256  # of the full frame
SWITCHES = 3  # back and forth
PULLED = 0.02  # of the value before the drag, a frame


@dataclass(frozen=True)
class Case:
    """The edited material of a scene, and two of its curves; the first is dragged."""

    material: str
    curves: tuple[str, str]


CASES = {
    "builtin:teatray": Case("glaze", ("highlight", "fresnel")),
    "builtin:earrings": Case("velvet", ("highlight", "fresnel")),
}


@dataclass(frozen=True)
class Effort:
    """Side of the picture in pixels, timed frames, edits of the random walk, and samples of the reference.

    `rival_s` limits the time of one picture of the rival; `checked` is the number of points at which light is summed
    again.
    """

    size: int
    lights: tuple[int, ...] = (400, 4000)
    frames: int = 40
    edits: int = 2000
    reference_spp: int = 4096
    rival_s: float = 120.0
    checked: int = 16


FULL = Effort(512)
QUICK = Effort(64, (400,), frames=8, edits=50, reference_spp=256, rival_s=2.0, checked=4)


def run(effort: Effort, progress: Progress = silent) -> dict[str, Any]:
    """Rows per scene and number of lights; the summary has figures common to all."""
    from lambent.baking.engine import engine

    engine()
    rows = []
    for name in tracked(list(CASES), progress, "scenes"):
        rows += _scene_rows(name, CASES[name], effort)
    rows.append({"scene": "full frame", **_full_frame(effort)})
    said = {"size": effort.size, "reference_spp": effort.reference_spp, "rival_limit_s": effort.rival_s}
    return {"rows": rows, "summary": said}


def _scene_rows(name: str, case: Case, effort: Effort) -> list[dict[str, Any]]:
    scene = load_scene(name)
    start = scene.materials[case.material]
    edited = _edited(start)
    session = Session.new(name, scene.cameras[0], {case.material: start}, size=(effort.size, effort.size))
    pictures, rows = [], []
    with tempfile.TemporaryDirectory() as folder:
        baked_view(scene, Path(folder) / "warm", effort.lights[0], 16)
        for lights in effort.lights:
            path = Path(folder) / str(lights)
            began = time.perf_counter()
            store = baked_view(scene, path, lights, effort.size)
            seconds, timings = time.perf_counter() - began, store.documents["timings"]
            stored = folder_bytes(path)
            began = time.perf_counter()
            picture = edited_picture(store, session)
            opening = time.perf_counter() - began
            row = {
                "scene": name, "lights": lights, "points": _points(store, session), "terms": _terms(store, session),
                "bake_seconds": round(seconds, 2), **{f"{kind}_seconds": round(s, 2) for kind, s in timings.items()},
                "stored_mib": round(stored / MIB, 1), "open_seconds": round(opening, 2),
                **errors_of_sums(store, session, scene, case.material, picture.image(), effort.checked),
                **_times(picture, session, case, effort), "memory_mib": round(held_bytes(picture) / MIB, 1),
            }  # fmt: skip
            session.change(case.material, edited)
            picture.show(case.material, session.editable(case.material))
            picture.draw()
            pictures.append(picture.image())
            session.undo()
            rows.append(row)
        shown = _shown(store, session)
    changed = Scene(**{**vars(scene), "materials": {**scene.materials, case.material: edited}})
    compared = _against_path_tracing(changed, pictures, shown, effort)
    return [row | errors for row, errors in zip(rows, compared, strict=True)]


def _edited(material: Material) -> Material:
    """Rougher and of another colour: an edit of curves and tints that a document can express."""
    lobes = [lobe.model_copy(update={"mx": 1.5 * lobe.mx, "my": 1.5 * lobe.my}) for lobe in material.lobes]
    return material.model_copy(update={"lobes": tuple(lobes), "kd": triple(np.multiply(material.kd, (1.0, 0.7, 0.5)))})


def baked_view(scene: Scene, folder: Path, lights: int, size: int) -> Store:
    quality = quality_named("normal").changed("bench", visibility={"lights": (lights,)})
    return bake(scene, folder, quality=quality, only={"transport"}, views=[View(scene.cameras[0], size, size)])


def _view_array(session: Session, kind: str, part: str) -> str:
    return view_artefact_name(session.document.camera, *session.document.size, kind, part)


def _points(store: Store, session: Session) -> int:
    return store.artefact(_view_array(session, "view_points", "pixel")).shape[0]


def _terms(store: Store, session: Session) -> int:
    return sum(a.name.endswith("/terms") and len(a.meta["terms"]) for a in store.artefacts("transport"))


def _shown(store: Store, session: Session) -> Flags:
    """(H, W) pixels that show a surface."""
    width, height = session.document.size
    shown = np.zeros(width * height, bool)
    shown[store.read(_view_array(session, "view_points", "pixel"))] = True
    return shown.reshape(height, width)


def _times(picture: EditedPicture, session: Session, case: Case, effort: Effort) -> dict[str, Any]:
    """Times of frames and switches, and the residual after a random walk."""
    start = session.material(case.material).now
    states, rng = drag(start), np.random.default_rng(0)
    picture.show(case.material, next(states))
    picture.draw()
    dense, frames, inexact = [], [], 0
    for state in islice(states, effort.frames // 4 + 1):
        dense.append(_ms(partial(_drawn, picture, case, state)))
    for state in islice(states, effort.frames):
        frames.append(_ms(partial(_frame, picture, case, state)))
        inexact += not picture.is_exact
    more = 1
    while not picture.is_exact:
        picture.step()
        more += 1
    switches = [_ms(partial(picture.activate, case.material, curve)) for curve in case.curves[::-1] * SWITCHES]
    for _ in range(effort.edits):
        picture.show(case.material, of_material(brightened(start, float(rng.uniform(0.7, 3.0)))))
        picture.step()
    while not picture.is_exact:
        picture.step()
    walked = picture.image()
    picture.draw()
    exact = picture.image()
    return {
        "dense_ms": _median(dense), "frame_ms": _median(frames), "frame_worst_ms": round(max(frames), 2),
        "frames_to_exact": more, "inexact_share": round(inexact / effort.frames, 3), "switch_ms": _median(switches),
        "switch_worst_ms": round(max(switches), 2),
        "drift": float(f"{np.abs(walked - exact).max() / exact.max():.2g}"),
    }  # fmt: skip


def drag(material: Material) -> Iterator[Editable]:
    """States of a drag, one per frame; curves are made before the frame, to exclude their time."""
    return (of_material(brightened(material, 1 + PULLED * k)) for k in count(1))


def brightened(material: Material, factor: float) -> Material:
    """The first node of the highlight times a factor, its neighbours by less.

    A Beckmann lobe of two slopes would need new transport for that: its roughness along t grows instead.
    """
    lobe, which = material.lobes[0], Which("shape")
    if lobe.distribution == "beckmann" and lobe.mx != lobe.my:
        return with_lobe(material, 0, lobe.model_copy(update={"mx": factor * lobe.mx}))
    values = values_of(material, which)
    return with_values(material, which, pulled(values, 0, factor * float(values[0, 0]), (0,), soft=True))


def _frame(picture: EditedPicture, case: Case, state: Editable) -> None:
    picture.show(case.material, state)
    picture.step()
    picture.image()


def _drawn(picture: EditedPicture, case: Case, state: Editable) -> None:
    picture.show(case.material, state)
    picture.draw()
    picture.image()


def _full_frame(effort: Effort) -> dict[str, Any]:
    """Every pixel shows one material with one curve, all of whose bands contribute."""
    pixels, size = effort.size**2, effort.size
    rng = np.random.default_rng(1)
    rows = np.stack([rng.random((3, pixels), np.float32).astype(np.float16) for _ in range(BANDS)])
    start = of_material(Material(kd=(0.5, 0.5, 0.5)))
    part = Part(start, np.arange(pixels), np.zeros(pixels), (Rows(rows),))
    picture = EditedPicture(np.zeros((size, size, 3), np.float32), {"it": part})
    states = [start.with_curve("diffuse", Curve.of(lambda x, k=k: np.exp(-x * (1 + k / 20)))) for k in range(20)]  # type: ignore[misc]
    case = Case("it", ("diffuse", "diffuse"))
    for state in states[:2]:
        _drawn(picture, case, state)
        _frame(picture, case, state)
    dense = [_ms(partial(_drawn, picture, case, state)) for state in states[:9]]
    frames = [_ms(partial(_frame, picture, case, state)) for state in states]
    return {
        "points": pixels, "terms": 1, "memory_mib": round(held_bytes(picture) / MIB, 1), "dense_ms": _median(dense),
        "frame_ms": _median(frames), "frame_worst_ms": round(max(frames), 2),
    }  # fmt: skip


def _against_path_tracing(
    scene: Scene, pictures: list[Floats], shown: Flags, effort: Effort
) -> Iterator[dict[str, Any]]:
    """Errors of edited pictures, and the time of path tracing with a denoiser for the same error."""
    from lambent.baking.reference.path_traced import tracer_of

    view = tracer_of(scene, max_depth=1), scene.cameras[0], (effort.size, effort.size)
    halves = [path_traced(*view, effort.reference_spp // 2, seed).mean() for seed in (1, 2)]
    converged = np.mean(halves, axis=0)
    exposure_ev = display_exposure(converged)  # of the whole picture: surfaces alone may be darker than its mean
    reference, half = (
        Reference(light, shown, exposure_ev, displayed(light, exposure_ev))
        for light in (image * shown[..., None] for image in (converged, halves[0]))
    )
    noise = half.errors(halves[1])["flip_shown"]
    wanted = [reference.errors(picture) for picture in pictures]
    path_traced(*view, 2, seed=3).denoised()  # compiles
    tried: list[tuple[int, float, float]] = []
    while not tried or (tried[-1][1] < effort.rival_s / 2 and tried[-1][2] > min(w["flip_shown"] for w in wanted)):
        spp = 2 ** (len(tried) + 1)
        began = time.perf_counter()
        image = path_traced(*view, spp, seed=3).denoised()
        tried.append((spp, time.perf_counter() - began, reference.errors(image)["flip_shown"]))
    for errors in wanted:
        found = {"psnr": errors["psnr"], "flip": errors["flip_shown"], "reference_flip": noise}
        enough = [trial for trial in tried if trial[2] <= errors["flip_shown"]]
        if enough:
            spp, seconds, flip = enough[0]
            yield {**found, "rival_spp": spp, "rival_seconds": round(seconds, 2), "rival_flip": flip}
        else:
            spp, seconds, flip = tried[-1]
            yield {**found, "rival_spp": f"> {spp}", "rival_seconds": f"> {seconds:.1f}", "rival_flip": flip}


def held_bytes(thing: object) -> int:
    """Bytes of all arrays that a picture holds, each counted once."""
    found: dict[int, int] = {}
    left, seen = [thing], set()
    while left:
        one = left.pop()
        if id(one) in seen:
            continue
        seen.add(id(one))
        if isinstance(one, np.ndarray):
            whole = one if one.base is None or not isinstance(one.base, np.ndarray) else one.base
            found[id(whole)] = whole.nbytes
        elif isinstance(one, dict):
            left += one.values()
        elif isinstance(one, list | tuple):
            left += one
        elif type(one).__module__.startswith("lambent.") and hasattr(one, "__dict__"):
            left += vars(one).values()
    return sum(found.values())


def _ms(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return 1e3 * (time.perf_counter() - began)


def _median(times: list[float]) -> float:
    return round(statistics.median(times), 2)
