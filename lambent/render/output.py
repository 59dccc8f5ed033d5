"""Stills, films and image sequences on disk."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import count
from pathlib import Path
from typing import Any, TypeVar

from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.errors import UserError, did_you_mean
from lambent.core.light.exposure import ev100_of
from lambent.core.light.light_mix import LightMix, MixTrack
from lambent.core.pictures.film import FILM, SEQUENCES, even_size, pictures_writer, radiance_wanted
from lambent.core.pictures.images import WRITABLE, check_writable, write_image, write_shown
from lambent.core.progress import Progress, silent, tracked
from lambent.core.views.camera import Camera, CameraPath
from lambent.core.views.projections import Projection
from lambent.realtime.frame_state import LIGHT_MAP, LIGHT_MAP_NOISE
from lambent.render.images import DRAWN, TRACED, Images, Settings
from lambent.render.projected import Projected, faces_settings
from lambent.scenes.camera_paths import camera_at
from lambent.scenes.loaders.keyframes import Known, read_keyframes
from lambent.scenes.looks.variants import looks_as_loaded, variant_named
from lambent.store.contract import SceneRecord, scene_record
from lambent.store.kept.states import says_light, variants_of
from lambent.store.kept.views import read_views, with_views
from lambent.store.light_groups import light_groups
from lambent.store.store import Store
from lambent.traced.room import why_untraceable

Named = TypeVar("Named", Camera, CameraPath)
Note = Callable[[str], None]
DEFAULT = Settings()


@dataclass(frozen=True)
class Rendered:
    """The written file, its size in pixels, its frames, the time taken in seconds, and its exposure.

    `exposure_ev` (stops on radiance) and `ev100` are None for radiance files and for false colours, which have `scale`:
    low, high, log, unit. `samples` of each pixel and `noise`, its relative standard error, are those of the last traced
    picture. For a contact sheet they describe the first picture; `ev100_by_name` has all values if they
    differ. `light_fields` has the statistics of light fields under the budget `Settings.light_field_mb`.
    """

    file: Path
    width: int
    height: int
    integrator: str
    frames: int
    seconds: float
    exposure_ev: float | None = None
    ev100: float | None = None
    scale: dict[str, float | bool | str] | None = None
    light_fields: dict[str, Any] | None = None
    ev100_by_name: dict[str, float] | None = None
    samples: int | None = None
    noise: float | None = None


def ignore(text: str) -> None:
    """Drop a note."""


def still(
    store: Store | Path | str,
    file: Path | str,
    camera: Camera | str | None = None,
    settings: Settings = DEFAULT,
    *,
    scene: str | None = None,
    note: Note = ignore,
    progress: Progress = silent,
) -> Rendered:
    """Render one image of a store.

    Parameters
    ----------
    store : Store or path
        A baked store, or its folder.
    file : path
        .exr and .hdr store linear radiance, W/(sr m^2); .png stores the displayed image.
    camera : Camera or str, optional
        A camera, or the name of a camera or saved view; by default the scene's first camera.
    settings : Settings
        Size, integrator, exposure, view transform.
    scene : str, optional
        For the path tracer: a scene file to trace in place of the bake's, with its own materials and lights.
    note : callable
        Called with a sentence for each thing that the store lacks or that has changed since the bake.

    Raises
    ------
    UserError
        If the file cannot be written, the store cannot be read, or a name or value is unknown.
    KeyboardInterrupt
        After the picture is written as traced so far, or without a picture.
    """
    began, file = time.perf_counter(), Path(file)
    check_writable(file, WRITABLE)
    opened, record = opened_with_views(store)
    view = view_of(record, camera)
    says_mix = settings.light is not None or says_light(opened, settings.variant)
    if camera is not None and not says_mix and (mix := read_views(opened.folder).lights.get(view.name)):
        settings = _lit(settings, opened, MixTrack.of(mix), "saved with the view", note)
    drawn = images(opened, settings, scene=scene, note=note)
    drawn.keeps = True
    write_still(drawn, file, view, progress)
    if drawn.interrupted:
        raise KeyboardInterrupt
    seconds, how = time.perf_counter() - began, drawn.settings.integrator
    return Rendered(file, settings.width, settings.height, how, 1, seconds, **displayed_as(file, drawn))


def displayed_as(file: Path, drawn: Images) -> dict[str, Any]:
    """Exposure or scale of a file, and light field statistics: the last fields of `Rendered`."""
    streamed: dict[str, Any] = {"light_fields": drawn.light_fields} if drawn.light_fields else {}
    streamed |= {"samples": drawn.samples, "noise": drawn.noise}
    if file.suffix.lower() not in (".png", FILM):
        return streamed
    if drawn.settings.is_false_coloured:
        return streamed | {
            "scale": None if drawn.scale is None else {**asdict(drawn.scale), "unit": drawn.quantity.unit}
        }
    exposure_ev = drawn.exposure_ev
    return streamed if exposure_ev is None else streamed | {"exposure_ev": exposure_ev, "ev100": ev100_of(exposure_ev)}


def write_still(drawn: Images, file: Path, view: Camera, progress: Progress = silent) -> None:
    """Draw one image into a file: displayed light for .png, else radiance."""
    if file.suffix.lower() == ".png":
        write_shown(file, drawn.displayed(view, progress))
    else:
        write_image(file, drawn.radiance(view, progress), drawn.settings.view_of(view).radiance_options())


def drawn_view(
    store: Store | Path | str,
    camera: str | None,
    settings: Settings = DEFAULT,
    *,
    note: Note = ignore,
    progress: Progress = silent,
) -> tuple[Floats, Camera]:
    """Radiance (height, width, 3), W/(sr m^2), of a store's view, and its camera; parameters as in `still`."""
    opened, record = opened_with_views(store)
    view = view_of(record, camera)
    return images(opened, settings, note=note).radiance(view, progress), view


def film(
    store: Store | Path | str,
    file: Path | str,
    path: CameraPath | str | None = None,
    settings: Settings = DEFAULT,
    *,
    fps: int = 30,
    keyframes: Path | None = None,
    scene: str | None = None,
    note: Note = ignore,
    progress: Progress = silent,
) -> Rendered:
    """Render a film, or an image sequence, along a camera path.

    Parameters
    ----------
    file : path
        .mp4 is a film, its size rounded down to even numbers; .png and .exr are sequences, numbered at the # signs of
        the name.
    path : CameraPath or str, optional
        A path, or the name of a camera path or recorded walk; by default the scene's first path.
    fps : int
        Frames per second.
    keyframes : path, optional
        A file of materials and light over time (`scenes.loaders.keyframes`).

    Other parameters and errors as in `still`.
    """
    began, file = time.perf_counter(), Path(file)
    check_writable(file, (FILM, *SEQUENCES))
    opened, record = opened_with_views(store)
    chosen = path if isinstance(path, CameraPath) else _named("path", record.paths, path)
    if keyframes is not None:
        settings = _with_keyframes(settings, opened, record, keyframes)
    says_mix = settings.light is not None or says_light(opened, settings.variant)
    if not says_mix and (track := read_views(opened.folder).tracks.get(chosen.name)):
        settings = _lit(settings, opened, track, "saved with the walk", note)
    if file.suffix.lower() == FILM:
        width, height = even_size(settings.width, settings.height)
        settings = replace(settings, width=width, height=height)
    drawn = images(opened, settings, moving=True, scene=scene, note=note)
    draw = drawn.radiance if radiance_wanted(file) else drawn.displayed
    cameras = [camera_at(chosen, index / fps) for index in range(chosen.frames(fps))]
    index = count()

    def draw_next(camera: Camera) -> NDArray[Any]:
        drawn.time_s = next(index) / fps
        return draw(camera)

    write_frames(file, cameras, draw_next, (settings.width, settings.height), fps, progress)
    seconds = time.perf_counter() - began
    width, height, said = settings.width, settings.height, displayed_as(file, drawn)
    return Rendered(file, width, height, drawn.settings.integrator, len(cameras), seconds, **said)


def write_frames(
    file: Path,
    cameras: Sequence[Camera],
    draw: Callable[[Camera], NDArray[Any]],
    size: tuple[int, int],
    fps: float,
    progress: Progress = silent,
) -> None:
    """Draw each camera into a film or an image sequence: see `core.pictures.film.pictures_writer`."""
    with pictures_writer(file, *size, fps) as write:
        for camera in tracked(cameras, progress, "frames"):
            write(draw(camera))


def images(
    store: Store, settings: Settings = DEFAULT, *, moving: bool = False, scene: str | None = None, note: Note = ignore
) -> Images:
    """Renderer of a store's images as arrays; `moving` for a film, other parameters as of `still`.

    What cannot be traced is drawn: the light map itself, its noise, and what `why_untraceable` says, with a note.
    """
    settings = exposed(settings, store)
    mix = _mix_of_variant(settings, store)
    if settings.light is None and mix.groups:
        settings = _lit(settings, store, MixTrack.of(mix), "of the variant", note)
    if settings.integrator == TRACED and settings.show in (LIGHT_MAP, LIGHT_MAP_NOISE):
        settings = drawn_instead(settings)
    if settings.integrator == TRACED and (why := why_untraceable(store)):
        drawn = images(store, drawn_instead(settings), moving=moving, scene=scene, note=note)
        note(f"drawn by {DRAWN}, not traced: {why}")
        return drawn
    if settings.projection is not Projection.perspective:
        return Projected(images(store, faces_settings(settings), moving=moving, scene=scene, note=note), settings)
    if settings.is_traced:
        from lambent.render.traced import TracedImages

        return TracedImages(store, settings, scene, note, moving=moving)
    from lambent.render.real_time import RealTime

    return RealTime(store, settings, moving, note)


def drawn_instead(settings: Settings) -> Settings:
    """Settings of a picture that cannot be traced."""
    return replace(settings, integrator=DRAWN, samples=None, noise=None, denoise=None)


def _with_keyframes(settings: Settings, store: Store, record: SceneRecord, file: Path) -> Settings:
    """Settings with the materials and light of a keyframe file."""
    looks = looks_as_loaded(record.materials, record.textures)
    coloured = {name: "diffuse" in one.parts for name, one in record.textures.items()}
    found = read_keyframes(file, Known(looks, variants_of(store), read_views(store.folder).lights, coloured))
    if not found.light.groups:
        return replace(settings, looks=found.looks)
    if settings.light is not None:
        raise UserError("light is also in the keyframes", field="--light", hint="leave out one")
    return replace(settings, looks=found.looks, light=found.light)


def _mix_of_variant(settings: Settings, store: Store) -> LightMix:
    """The light mix of the settings' variant."""
    return variant_named(variants_of(store), settings.variant).light if settings.variant else LightMix()


def _lit(settings: Settings, store: Store, light: MixTrack, whose: str, note: Note) -> Settings:
    """Settings with the mix of a view, walk or variant, if store and integrator can show it."""
    missing = sorted(set(light.groups) - {group.name for group in light_groups(store)})
    if missing:
        note(f"light mix {whose} not applied: the store has no light group {', '.join(missing)}")
        return settings
    return replace(settings, light=light)


def exposed(settings: Settings, store: Store) -> Settings:
    """Checked settings; without an exposure, they get the one of the store's scene."""
    settings.check()
    if settings.exposure_ev is None:
        settings = replace(settings, exposure_ev=scene_record(store).exposure_ev)
        settings.check()
    return settings


def opened_with_views(store: Store | Path | str) -> tuple[Store, SceneRecord]:
    """The store, and its scene record with the saved views."""
    opened = store if isinstance(store, Store) else Store.open(Path(store))
    return opened, with_views(scene_record(opened), read_views(opened.folder))


def view_of(record: SceneRecord, camera: Camera | str | None) -> Camera:
    """The camera itself, or the camera of this name; by default the scene's first."""
    return camera if isinstance(camera, Camera) else _named("camera", record.cameras, camera)


def _named(kind: str, choices: Iterable[Named], name: str | None) -> Named:
    found = {choice.name: choice for choice in choices}
    if not found:
        raise UserError(f"scene has no {kind}", hint=f"add [[{kind}s]] to its scene.toml")
    if name is None:
        return next(iter(found.values()))
    if name not in found:
        hint = did_you_mean(name, found)
        raise UserError(f"unknown {kind}", field=f"--{kind}", got=name, expected=", ".join(found), hint=hint)
    return found[name]
