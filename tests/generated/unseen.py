"""Scenes that users bring and that nothing here was tuned for, baked and compared by the commands that users type.

    nice python -m tests.generated.unseen FOLDER [--only NAME] [--json FILE]

Each is written, baked as a draft, drawn at rest and path traced with two seeds. FOLDER/NAME/row.json keeps its row;
the same command does the rest, and `--only` again what it names. `--json` writes all to another file. A row is:

- `outcome`: "baked", the one line that refuses it, or "fault: ..." for a traceback, a signal or too much time;
- `bake_s`, processor time; `triangles`; `texels` of the light map; `warnings`, of which a person reads READABLE lines;
- `flip` of the picture at rest against the mean of the path traced ones, `noise` between those, `worst_tile` and
  `noise_tile`, of 16 x 16 pixels; `level`, their mean radiance over that of the paths; or `dark`, the largest radiance
  where the paths find none. A scene holds if the means differ by at most MEAN and no tile exceeds TILE.
- `of_pixels`: the side of squares whose means are compared instead of pixels, where the paths' noise exceeds NOISY.
"""

from __future__ import annotations

import argparse
import json
import resource
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from lambent.bench.measuring.reference import Truth
from lambent.core.arrays import Floats
from lambent.core.files import write_text
from lambent.core.light.exposure import exposure_of
from lambent.core.pictures import metrics
from lambent.core.pictures.images import read_image
from lambent.render.images import DARK_EV100
from lambent.store.contract import scene_record
from lambent.store.store import Store
from tests.generated import cad, light, odd

MEAN, TILE, READABLE = 0.02, 0.3, 8
NOISY, SQUARES = 0.2, (1, 2, 4)  # sides that divide SIZE and a tile
SIZE, PATHS, LONGEST_S, DONE = "192x108", 256, 1800, "done"
DARK = 0.18 * 2 ** -exposure_of(DARK_EV100)  # W/(sr m^2): middle grey where a picture warns that light may be a leak
UNSEEN: dict[str, Callable[[Path], Path]] = {
    write.__name__: write
    for write in (
        cad.centimetres_glb, cad.centimetres_obj, cad.kitchen_in_metres, cad.broken, cad.names, cad.mirrored,
        cad.millimetre, cad.doubled, cad.inside_out, cad.against_winding, cad.terrain, cad.ground_50km,
        cad.cad_nodes, cad.million, cad.statues_1k, cad.statues_17k, cad.statues_266k,
        light.leak_1mm, light.leak_0mm, light.keyhole, light.shaded_lamp, light.ceiling_lamp, light.only_emissive,
        light.no_light, light.candle, light.horizon_sun, light.low_sun, light.sun_below, light.overcast,
        light.narrow_spot, light.sixty,
        odd.flush, odd.uv_huge, odd.uv_zero, odd.uv_overlapping, odd.texture_8k, odd.texture_1, odd.albedo_one,
        odd.mirror_box, odd.glass_stack, odd.camera_in_wall, odd.camera_down, odd.kd_over_one, odd.perfect_lobes,
        odd.sharpest, odd.brushed, odd.gltf_extremes, odd.damaged_table, odd.one_wavelength, odd.sixteen_wavelengths,
    )
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", action="append", choices=UNSEEN, metavar="NAME")
    parser.add_argument("--json", type=Path)
    said = parser.parse_args()
    rows: dict[str, Any] = {}
    for name in said.only or UNSEEN:
        kept = said.folder / name / "row.json"
        if said.only or not kept.exists():
            kept.unlink(missing_ok=True)
            write_text(kept, json.dumps(row(name, kept.parent), indent=1))
        rows[name] = json.loads(kept.read_text("utf-8"))
        print(in_words(name, rows[name]), flush=True)  # noqa: T201
    print("\n".join(table(rows)))  # noqa: T201
    if said.json:
        write_text(said.json, json.dumps(rows, indent=1))


def row(name: str, folder: Path) -> dict[str, Any]:
    """Write a scene, bake it, and compare its pictures."""
    shutil.rmtree(folder, ignore_errors=True)
    scene, store = UNSEEN[name](folder / "scene"), folder / "baked.store"
    outcome, bake_s = lambent(folder / "bake", "bake", scene, "-o", store, "--quality", "draft", "--json")
    found: dict[str, Any] = {"outcome": outcome, "bake_s": round(bake_s, 1)}
    if outcome != DONE:
        return found
    warnings = json.loads((folder / "bake.out").read_text())["warnings"]
    arrays = Store.open(store)
    height, width, _ = arrays.artefact("light_map/irradiance").shape
    triangles = sum(o.face_count for o in scene_record(arrays).objects)
    found |= {"outcome": "baked", "warnings": warnings, "triangles": triangles, "texels": height * width}
    pictures = {"rest": (), "path_1": ("--seed", 1), "path_2": ("--seed", 2)}
    for picture, seed in pictures.items():
        path = ("--integrator", "path", "--samples", PATHS, "--no-denoise") if seed else ()
        output = folder / f"{picture}.exr"
        outcome, _ = lambent(folder / picture, "render", store, "--size", SIZE, "-o", output, *path, *seed)
        if outcome != DONE:
            return found | {"outcome": f"baked, but not drawn: {outcome}"}
    return found | compared(*(read_image(folder / f"{picture}.exr") for picture in pictures))


def lambent(log: Path, *arguments: object) -> tuple[str, float]:
    """Run the command as a user does: DONE, its refusing line, or a fault; and the processor time, s.

    What it prints is in LOG.out and LOG.err.
    """
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "lambent", *map(str, arguments)]
    with log.with_suffix(".out").open("wb") as out, log.with_suffix(".err").open("wb") as err:
        code = subprocess.run(command, stdout=out, stderr=err, check=False, preexec_fn=_limit).returncode
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = sum(getattr(after, key) - getattr(before, key) for key in ("ru_utime", "ru_stime"))
    said = log.with_suffix(".err").read_text("utf-8", "replace")
    lines = [line for line in said.splitlines() if line.strip()]
    if code == 0:
        return DONE, seconds
    if code == 2 and "Traceback" not in said:
        return f"refused: {lines[-1]}", seconds
    ended = "too slow" if code == -signal.SIGXCPU else f"code {code}, {lines[-1] if lines else ''}"
    return f"fault: {ended}", seconds


def _limit() -> None:
    """End this process after LONGEST_S of the processor."""
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST_S, resource.RLIM_INFINITY))


def compared(rest: Floats, *paths: Floats) -> dict[str, Any]:
    """Errors of the picture at rest (H, W, 3), and between paths; its largest value if those are dark."""
    if not np.mean(paths) > 0:
        return {"dark": float(rest.max())}
    for side in SQUARES:
        shown, *traced = (means(picture, side) for picture in (rest, *paths))
        truth = Truth.of(traced)
        if truth.noise is not None and truth.noise <= NOISY:
            break
    between = metrics.flip_error(*map(truth.shown, traced))
    error = metrics.flip_error(truth.encoded, truth.shown(shown))
    worst = {name: round(float(metrics.tile_means(of, metrics.TILE // side).max()), 4)
             for name, of in (("worst_tile", error), ("noise_tile", between))}  # fmt: skip
    level = round(float(rest.mean() / np.mean(paths)), 3)
    squares = {"of_pixels": side} if side > 1 else {}
    return {"flip": round(float(error.mean()), 4), "noise": truth.noise, **worst, "level": level, **squares}


def means(picture: Floats, side: int) -> Floats:
    """Means (H / side, W / side, 3) over squares of a picture (H, W, 3)."""
    height, width, channels = picture.shape
    return picture.reshape(height // side, side, width // side, side, channels).mean(axis=(1, 3))


def misses(found: dict[str, Any]) -> list[str]:
    """What a row fails in."""
    said = [found["outcome"]] if not found["outcome"].startswith(("baked", "refused: ")) else []
    said += [found["outcome"]] if "not drawn" in found["outcome"] else []
    warnings = found.get("warnings", [])
    said += ["warnings"] if len(warnings) > READABLE or len(set(warnings)) < len(warnings) else []
    if "flip" in found:
        said += ["flip"] if found["flip"] > found["noise"] + MEAN else []
        said += ["tile"] if found["worst_tile"] > TILE else []
    return said + (["not dark"] if found.get("dark", 0) > DARK else [])


def table(rows: dict[str, Any]) -> list[str]:
    """A line for each scene: FLIP at rest and noise, worst tile, seconds of its bake, and what it misses."""
    lines = ["scene               FLIP / noise  tile  bake s"]
    for name, found in rows.items():
        if "flip" in found:
            figures = f"{found['flip']:.3f} / {found['noise']:.3f}   {found['worst_tile']:.2f}   {found['bake_s']:.0f}"
        else:
            figures = "dark, as it should be" if found.get("dark", 1) <= DARK else found["outcome"].partition(":")[0]
        lines.append(f"{name:18}  {figures:27}  {', '.join(misses(found))}".rstrip())
    return lines


def in_words(name: str, found: dict[str, Any]) -> str:
    keys = ("bake_s", "triangles", "texels", "flip", "noise", "worst_tile", "noise_tile", "of_pixels", "level", "dark")
    figures = [f"{key} {found[key]}" for key in keys if key in found]
    lines = [f"{name}: {found['outcome']}; {', '.join(figures)}", *(f"    {one}" for one in found.get("warnings", []))]
    return "\n".join([*lines, *(f"    MISS {one}" for one in misses(found))])


if __name__ == "__main__":
    main()
