"""Stores of baked scenes: pictures, films, contact sheets and illuminance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from lambent.api.describing import facts_of_store
from lambent.api.materials import Material
from lambent.api.pictures import Picture
from lambent.api.progress import Wanted, progress_of
from lambent.core.discovery import known
from lambent.core.errors import UserError, invalid
from lambent.core.extras import needing_extras
from lambent.core.light.exposure import metered
from lambent.core.light.light_mix import LightMix, MixTrack, parse_light
from lambent.core.surroundings import Axis, Layout
from lambent.core.views.camera import Camera
from lambent.scenes.looks.variants import variant_named
from lambent.scenes.scene import Look, Variant
from lambent.store.contract import SCENE, scene_record
from lambent.store.kept.states import variants_of
from lambent.store.kept.views import read_views
from lambent.store.light_groups import light_groups
from lambent.store.store import Store as Arrays

if TYPE_CHECKING:
    from lambent.api.views import View
    from lambent.render import Images, Rendered, Settings
    from lambent.render.illuminance import Illuminated

Light = (
    str | Mapping[str, float | str]
)  # a variant or state; or by light group: a factor, "off", "2700K", "0.5,#ffd0a0"
Note = Callable[[str], None]


class Store:
    """A baked scene.

    Parameters
    ----------
    folder : str or Path

    Raises
    ------
    UserError
        If the folder is no store, or of another version.
    """

    def __init__(self, folder: str | Path) -> None:
        self.arrays = Arrays.open(Path(folder))

    @property
    def folder(self) -> Path:
        return self.arrays.folder

    @property
    def cameras(self) -> dict[str, Camera]:
        """Cameras of the scene and saved views, by name."""
        saved = read_views(self.folder).cameras
        return {camera.name: camera for camera in (*scene_record(self.arrays).cameras, *saved)}

    @property
    def materials(self) -> dict[str, Material]:
        """By name, as baked."""
        return {name: Material(document) for name, document in scene_record(self.arrays).materials.items()}

    @property
    def variants(self) -> tuple[str, ...]:
        """Variants of the scene, and states stored in the window."""
        return tuple(one.name for one in variants_of(self.arrays))

    @property
    def light_groups(self) -> tuple[str, ...]:
        """Groups of lamps whose light can be mixed."""
        return tuple(group.name for group in light_groups(self.arrays))

    def render(
        self,
        camera: str | Camera | None = None,
        *,
        size: tuple[int, int] = (1280, 720),
        integrator: str = "traced",
        light: Light | None = None,
        edits: Mapping[str, Material] | None = None,
        variant: str = "",
        exposure_ev: float | None = None,
        view: str = "filmic",
        note: Note | None = None,
        progress: Wanted = None,
        **settings: Any,
    ) -> Picture:
        """Render a still.

        Parameters
        ----------
        camera : str or Camera, optional
            A camera, or the name of a camera or saved view; by default the scene's first.
        size : (width, height)
            Pixels.
        integrator : str
            "traced" against the baked light, "path" for whole paths, or a real-time one: "lamps", "rings", ...
        light : str or mapping, optional
            The light of a variant or a stored state, or values by light group: a factor, "off", "2700K",
            "0.5,#ffd0a0".
        edits : mapping, optional
            Materials in place of the baked ones, by name; the light of other surfaces follows.
        variant : str
            A variant or stored state: its materials and its light; "saved" is the room as the window left it.
        exposure_ev : float, optional
            Stops; by default the scene's, else metered.
        view : {"filmic", "neutral", "linear"}
        note : callable, optional
            Called with a sentence for each thing that the store lacks.
        progress : bool or callable, optional
            As of `Table.fit`.
        **settings
            Further fields of `lambent.render.Settings`: samples, noise, denoise, sky_turn_deg, seed, ...

        Raises
        ------
        UserError
            If the store cannot be drawn, or a name or value is unknown.
        """
        from lambent.render.output import opened_with_views, view_of

        said = self._settings(
            size, light, variant, integrator=integrator, exposure_ev=exposure_ev, view=view, **settings
        )
        with needing_extras():
            drawn = self._images(said, edits or {}, note)
        return _picture(drawn, view_of(opened_with_views(self.arrays)[1], camera), progress)

    def as_left(self, *, note: Note | None = None, progress: Wanted = None, **settings: Any) -> Picture:
        """Render what the store's window showed last: its edits, lamps, light, camera, size, exposure and look.

        Parameters and errors as of `render`; `settings` replace those of the session.
        """
        from lambent.render import as_left

        given = {*settings} | ({"width", "height"} if "size" in settings else set())
        wanted = self._settings(settings.pop("size", (1280, 720)), None, "", **settings)
        chosen, camera = as_left(self.arrays, wanted, given)
        with needing_extras():
            return _picture(self._images(chosen, {}, note), camera or next(iter(self.cameras.values())), progress)

    def edited(self, session: str | Path, *, surfaces: tuple[int, int] = (1, 99), **settings: Any) -> Picture:
        """Draw the view of a session of edits (.edits.json), from the transport that the store has for it.

        `surfaces` are the least and most on the shown light paths, 1 being direct light; `settings` as of `render`:
        exposure_ev, view.
        """
        from lambent.render.edited import edited_view

        return _picture(
            *edited_view(self.arrays, Path(session), self._settings((1, 1), None, "", **settings), surfaces)
        )

    def relight(
        self,
        camera: str | None = None,
        *,
        environment: str | Path | None = None,
        layout: Layout | None = None,
        up: Axis = "+y",
        scale: float = 1.0,
        turn_deg: float = 0.0,
    ) -> Picture:
        """Draw a view under a turned or another environment: direct light with shadows.

        Parameters
        ----------
        camera : str, optional
            Of a view that was baked for relighting, by name; by default the first. `UserError` if there is none.
        environment : str or Path, optional
            Picture that lights the scene; by default the scene's own environment.
        layout, up, scale
            Of the picture: recognised by default; the world axis of its up direction; factor on its radiance.
        turn_deg : float
            Rotation of the environment about +y.
        """
        from lambent.editing.relit_view import RelitView, views_for_relighting
        from lambent.scenes.scene import ImageEnvironment

        if not (views := views_for_relighting(self.arrays)):
            hint = "see docs/editing.md, Relighting"
            raise UserError("has no view baked for relighting", file=self.folder, hint=hint)
        record = views[next(iter(views)) if camera is None else known("camera", camera, views, field="--camera")]
        view = RelitView(self.arrays, record.camera, record.width, record.height)
        if environment is not None:
            view.light(ImageEnvironment(Path(environment), scale, 0.0, layout, up))
        view.turn(turn_deg)
        view.draw()
        image = view.image()
        details = {"camera": record.camera.name, "left_out": view.error}
        return Picture(image, metered(image) or 0.0, details=details)

    def film(
        self, file: str | Path, path: str | None = None, *, size: tuple[int, int] = (1280, 720), fps: int = 30,
        light: Light | None = None, variant: str = "", keyframes: str | Path | None = None, progress: Wanted = None,
        **settings: Any,
    ) -> Rendered:  # fmt: skip
        """Write a film (.mp4) or an image sequence (.png, .exr with # signs) along a camera path, by default the first.

        `keyframes` is a file of materials and light over time (.toml); other parameters and errors as of `render`.
        """
        from lambent.render import film

        with needing_extras(), progress_of(progress) as bar:
            return film(
                self.arrays, file, path, self._settings(size, light, variant, **settings), fps=fps,
                keyframes=None if keyframes is None else Path(keyframes), progress=bar,
            )  # fmt: skip

    def sheet(
        self, file: str | Path, camera: str | None = None, *, size: tuple[int, int] = (640, 360),
        exposures: Literal["light", "each", "one"] = "light", progress: Wanted = None, **settings: Any,
    ) -> Rendered:  # fmt: skip
        """Write a contact sheet of all variants (.png).

        `exposures`: metered once for each mix of light, for each picture, or as the first; other parameters and errors
        as of `render`.
        """
        from lambent.render import sheet

        with needing_extras(), progress_of(progress) as bar:
            chosen = self._settings(size, None, "", **settings)
            return sheet(self.arrays, file, camera, chosen, exposures=exposures, progress=bar)

    def illuminance(
        self,
        grid: str | Sequence[str] | None = None,
        *,
        over: str | None = None,
        height_m: float | None = None,
        spacing_m: float | None = None,
        margin_m: float | None = None,
        light: Light | None = None,
        variant: str = "",
        error: float = 0.005,
        maintenance: float = 1.0,
        progress: Wanted = None,
    ) -> list[Illuminated]:
        """Trace the illuminance in lx on calculation grids.

        Parameters
        ----------
        grid : str or sequence of str, optional
            Grids of the scene by name; by default all.
        over : str, optional
            Instead: an object, or a room's floor, with points `height_m` above it, `spacing_m` apart, without a band
            of `margin_m`; defaults as in EN 12464-1.
        error : float
            Most relative standard error of a point.
        maintenance : float
            Factor on all results.

        Returns
        -------
        list of Illuminated
            Points, lx, standard errors; `facts()` has mean, extremes and uniformities.

        Raises
        ------
        UserError
            If the store cannot be traced, or has no such grid, object or light, or a number is out of range.
        """
        from pydantic import ValidationError

        from lambent.render.illuminance import illuminated
        from lambent.scenes.loaders.scene_toml.grids import GridSection

        wanted: GridSection | list[str] = [grid] if isinstance(grid, str) else list(grid or ())
        if over is not None and wanted:
            raise UserError("excludes over", field="grid", hint="leave out one")
        if over is not None:
            try:
                wanted = GridSection(name=over, object=over, height_m=height_m, spacing_m=spacing_m, margin_m=margin_m)
            except ValidationError as fault:
                raise invalid(fault, "over") from fault
        settings, state = self._settings((1, 1), light, variant), variant or (light if isinstance(light, str) else "")
        with needing_extras(), progress_of(progress) as bar:
            return illuminated(
                self.arrays, settings, wanted, state or "as baked", error, maintenance, lambda text: None, bar
            )

    def view(
        self,
        camera: str | Camera | None = None,
        *,
        size: tuple[int, int] = (960, 540),
        light: Light | None = None,
        edits: Mapping[str, Material] | None = None,
        variant: str = "",
        exposure_ev: float | None = None,
    ) -> View:
        """Open a live view in the cell of a notebook, as the last line of the cell: walk, look, change.

        The mouse and the keys do what they do in the window of `lambent walk`, controls below the picture change
        variant, camera, exposure, light and the material of a clicked object; a picture at rest is traced. Nothing is
        written into the store, unless V saves a view. Close a view that is not needed any more: it holds a graphics
        device and, at rest, a process that traces.

        Parameters
        ----------
        camera, light, edits, variant, exposure_ev
            How it begins; as of `render`.
        size : (width, height)
            Of the picture in the browser's pixels.

        Raises
        ------
        UserError
            If this is no notebook, a package of `lambent[notebook]` or a graphics adapter is missing, the store cannot
            be drawn, or a name or value is unknown.
        """
        from lambent.api.views import View
        from lambent.render.output import opened_with_views, view_of

        known("variant", variant, ("", *self.variants), field="variant")
        self._check(edits or {})
        settings = self._settings(size, light, variant, exposure_ev=exposure_ev)
        settings.check()
        track = settings.light
        where = None if camera is None else view_of(opened_with_views(self.arrays)[1], camera)
        with needing_extras():
            from lambent.viewer.canvas.cell import open_cell

            cell = open_cell(self.folder, size)
        mix = None if track is None else LightMix({name: keys[0][1] for name, keys in track.groups.items()})
        cell.begin(where, variant, mix, {name: one.document for name, one in (edits or {}).items()}, exposure_ev)
        return View(cell)

    def light_map(self, file: str | Path) -> None:
        """Write the light map as an image (.exr, W/m^2) and, beside it, its meshes (.glb), uv2 as second coordinates.

        Raises `UserError` if the store has no complete light map, or a file cannot be written.
        """
        from lambent.store.light_map_file import write_light_map

        write_light_map(self.arrays, Path(file))

    def facts(self) -> dict[str, Any]:
        """Arrays, complete or not, whether every chunk on disk is sound, and what the scene offers, by name."""
        return facts_of_store(self.arrays)

    def _settings(self, size: tuple[int, int], light: Light | None, variant: str, **settings: Any) -> Settings:
        from lambent.render import Settings

        try:
            return Settings(*size, light=self._mix(light), variant=variant, **settings)
        except TypeError as error:  # a field that there is not
            raise UserError(str(error).partition(") ")[2], field="render") from error

    def _mix(self, light: Light | None) -> MixTrack | None:
        if light is None:
            return None
        if isinstance(light, str):
            return MixTrack.of(variant_named(variants_of(self.arrays), light).light)
        for name in light:
            known("light group", name, self.light_groups, field="light")
        return parse_light(f"{name}={value}" for name, value in light.items())

    def _check(self, edits: Mapping[str, Material]) -> None:
        for name in edits:
            known("material", name, scene_record(self.arrays).materials, field="edits")

    def _images(self, settings: Settings, edits: Mapping[str, Material], note: Note | None) -> Images:
        from lambent.render import images

        drawn = images(self.arrays, settings, note=note or (lambda text: None))
        if edits:
            self._check(edits)
            record, names = scene_record(self.arrays), variants_of(self.arrays)
            own = {name: name if name in record.textures else "" for name in edits}
            before = variant_named(names, settings.variant) if settings.variant else Variant("edits")
            looks = {name: Look(one.document, own[name]) for name, one in edits.items()}
            drawn.apply_variant(replace(before, looks={**before.looks, **looks}))
        return drawn

    def __repr__(self) -> str:
        if SCENE not in self.arrays.documents:
            return f"Store({str(self.folder)!r}, edited views alone)"
        record = scene_record(self.arrays)
        return (
            f"Store({str(self.folder)!r}, {record.name!r}, {len(record.objects)} objects, "
            f"{len(self.cameras)} cameras, {len(self.variants)} variants)"
        )


def _picture(drawn: Images, camera: Camera, progress: Wanted = None) -> Picture:
    with needing_extras(), progress_of(progress) as bar:
        radiance = drawn.radiance(camera, bar)
    details = {"integrator": drawn.settings.integrator, "samples": drawn.samples, "noise": drawn.noise}
    return Picture(radiance, drawn.exposed(radiance), drawn.settings.view, details=details)
