"""Stores of baked scenes: pictures, films, contact sheets and illuminance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lambent.api.describing import variants_in_words
from lambent.api.materials import Material
from lambent.api.pictures import Picture
from lambent.api.progress import Wanted, progress_of
from lambent.core.discovery import known
from lambent.core.errors import UserError, invalid
from lambent.core.extras import needing_extras
from lambent.core.light.light_mix import LightMix, MixTrack, parse_light
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
        where = view_of(opened_with_views(self.arrays)[1], camera)
        with needing_extras(), progress_of(progress) as bar:
            radiance = drawn.radiance(where, bar)
        details = {"integrator": drawn.settings.integrator, "samples": drawn.samples, "noise": drawn.noise}
        return Picture(radiance, drawn.exposed(radiance), view, details=details)

    def film(
        self, file: str | Path, path: str | None = None, *, size: tuple[int, int] = (1280, 720), fps: int = 30,
        light: Light | None = None, variant: str = "", progress: Wanted = None, **settings: Any,
    ) -> Rendered:  # fmt: skip
        """Write a film (.mp4) or an image sequence (.png, .exr with # signs) along a camera path, by default the first.

        Other parameters and errors as of `render`.
        """
        from lambent.render import film

        with needing_extras(), progress_of(progress) as bar:
            return film(
                self.arrays, file, path, self._settings(size, light, variant, **settings), fps=fps, progress=bar
            )

    def sheet(
        self, file: str | Path, camera: str | None = None, *, size: tuple[int, int] = (640, 360),
        progress: Wanted = None, **settings: Any,
    ) -> Rendered:  # fmt: skip
        """Write a contact sheet of all variants (.png); parameters and errors as of `render`."""
        from lambent.render import sheet

        with needing_extras(), progress_of(progress) as bar:
            return sheet(self.arrays, file, camera, self._settings(size, None, "", **settings), progress=bar)

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
        track, where = self._mix(light), None if camera is None else view_of(opened_with_views(self.arrays)[1], camera)
        with needing_extras():
            from lambent.viewer.canvas.cell import open_cell

            cell = open_cell(self.folder, size)
        mix = None if track is None else LightMix({name: keys[0][1] for name, keys in track.groups.items()})
        cell.begin(where, variant, mix, {name: one.document for name, one in (edits or {}).items()}, exposure_ev)
        return View(cell)

    def light_map(self, file: str | Path) -> None:
        """Write the light map as an image (.exr, W/m^2) and, beside it, its meshes (.glb), uv2 as second coordinates.

        Raises
        ------
        UserError
            If the store has no complete light map, or a file cannot be written.
        """
        from lambent.store.light_map_file import write_light_map

        write_light_map(self.arrays, Path(file))

    def facts(self) -> dict[str, Any]:
        """Arrays, complete or not, whether every chunk on disk is sound, and what the scene offers, by name."""
        store, has_scene, groups = self.arrays, SCENE in self.arrays.documents, light_groups(self.arrays)
        return {
            "is": "store",
            "arrays": {
                a.name: f"{'x'.join(map(str, a.shape))} {a.dtype}, {_health(store, a)}" for a in store.artefacts()
            },
            "documents": sorted(store.documents),
            "light_groups": {g.name: f"{g.share:.1%} of the light: {', '.join(g.members)}" for g in groups},
            "variants": variants_in_words(variants_of(store) if has_scene else ()),
            "reflectors": _reflectors(store) if has_scene else [],
            "inputs": store.inputs,
        }

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


def _health(store: Arrays, artefact: Any) -> str:
    if not artefact.complete:
        return str(artefact.state)
    try:
        store.read(artefact.name)
    except UserError as error:
        return error.message
    return "complete"


def _reflectors(store: Arrays) -> list[str]:
    """Planar reflectors in words: area, objects, plane."""
    words = []
    for r in scene_record(store).reflectors:
        *n, d = (round(x, 3) + 0.0 for x in r.plane)
        area = sum(part.area_m2 for part in r.parts)
        words.append(f"{area:.2f} m2 of {', '.join(part.object for part in r.parts)}: n {n}, d {d}")
    return words
