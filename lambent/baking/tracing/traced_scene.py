"""The scene in traceable form: Mitsuba's scenes, and the lit and visible points of the light map, each created once.

Everything follows from the scene and the split meshes alone: a resumed bake finds the same.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from pathlib import Path
from typing import Any, cast

import numpy as np

from lambent.baking.light.cache import GroupedCache, LightMapCache
from lambent.baking.light.lamps import LampLight, LampPoints, drawn_of
from lambent.baking.light.stitching import Cuts, cuts_of
from lambent.baking.sky.sent import SentSky
from lambent.baking.sky.sun import FoundSun, is_sun, sun_of
from lambent.baking.surfaces.atlas import Atlas
from lambent.baking.surfaces.backs import crossed_by_light
from lambent.baking.surfaces.texels import POINTS, Sides, Texels, chart_labels, texels_of
from lambent.baking.tracing.first_light import FirstLight, bare_sky, sky_without
from lambent.baking.tracing.group_tally import Direct, GroupTally, MixTally, Sorting
from lambent.baking.tracing.lights.emitters import balance_emitters
from lambent.baking.tracing.lights.lamps import LampRays
from lambent.baking.tracing.lights.sun import NoSun, Sun, SunRays, Unseen
from lambent.baking.tracing.scene_builder import EmitterSampling, SceneBuilder, emitter_of_environment
from lambent.baking.tracing.seen.visibility import seen, viewing_places, without_hidden
from lambent.baking.tracing.solids import SolidTest
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.inputs import sha256_of
from lambent.core.light.light_mix import WHITE
from lambent.core.plain import Triple
from lambent.core.progress import Progress, silent
from lambent.materials.measured.registry import load
from lambent.materials.measured.tables.patch_sheet import Lookup, lookup_of
from lambent.scenes.light_groups import SortedLights, sorted_lights
from lambent.scenes.panes import panes_of
from lambent.scenes.scene import Scene

FOUND = ("_found_sun", "places", "drawn_lamps", "_drawn_light")  # found by tracing, or by reading pictures


class TracedScene:
    """Shared by the artefacts of a bake. `merged` is the concatenated geometry of the atlas, as from `atlas.merged`.

    `two_sided` flags each object whose back has a light map too: because light crosses it, or viewers see it. The
    light map leaves out the scene's sun unless `sun_left_out` is false. If `lamps_apart`, its samples leave out lamps,
    whose light is `lamp_light`. Objects in `unmapped` have no texels in it. The sky is guided with `effort`
    (`sky.guide.learn`).

    Pickled, it has no texels, but all else that takes tracing to find. A process keeps the last one it unpickled.
    """

    def __init__(
        self, atlas: Atlas, merged: dict[str, Floats], two_sided: list[bool], progress: Progress = silent, *,
        sun_left_out: bool = True, lamps_apart: bool = False, unmapped: Collection[str] = (), effort: float = 1.0,
    ) -> None:  # fmt: skip
        self.atlas, self.scene, self.merged, self.progress = atlas, atlas.scene, merged, progress
        self.two_sided, self._sun_left_out, self._unmapped, self._effort = two_sided, sun_left_out, unmapped, effort
        self._lamps_apart = lamps_apart
        counts = [len(o.mesh.faces) for o in self.scene.objects]
        self._two_sided, self._crossed = np.repeat(two_sided, counts), np.repeat(crossed_by_light(self.scene), counts)
        self._builder: tuple[tuple[bool, bool], SceneBuilder] | None = None
        self._whole: Any = None
        self._bare: tuple[Any, Any] | None = None  # whole, and without openings
        self._sampling: EmitterSampling | None = None
        self._sky_without: tuple[Any] | None = None
        self._sides: dict[float, Sides] = {}
        self._views: dict[float, tuple[Sides, Indices]] = {}
        self._lamp_light: dict[float, LampLight] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        made = partial(
            TracedScene, self.atlas, {}, self.two_sided, sun_left_out=self._sun_left_out,
            lamps_apart=self._lamps_apart, unmapped=self._unmapped, effort=self._effort,
        )  # fmt: skip
        self.unseen(diffuse=self._at_hand["diffuse"])
        assert self._sampling is not None, "a builder found it"
        sky, (without,) = self._sampling.environment, self._sky_without or (None,)
        skies = [None if one is None else SentSky.of(one) for one in (sky, without)]
        found = {name: getattr(self, name) for name in FOUND}
        state = made, found, self._sampling.weights, skies, without is sky
        return _unpickled, (pickle.dumps(state),)

    def _take(self, found: dict[str, Any], weights: Floats, skies: list[SentSky | None], is_same: bool) -> None:
        """Take over what another process found."""
        self.__dict__ |= found
        environment, sun = self.scene.environment, self._found_sun
        sky = None if skies[0] is None else skies[0].like(emitter_of_environment(environment))
        self._sampling = EmitterSampling(sky, weights)
        if is_same:
            self._sky_without = (sky,)
        elif skies[1] is not None and sun is not None and environment is not None:
            self._sky_without = (skies[1].like(bare_sky(sun, environment)),)

    def builder(self, *, diffuse: bool, photons: bool = False) -> SceneBuilder:
        """Builder of the scene, with or without diffuse terms; kept until the other one is needed.

        Kernels contain every live BSDF, traced or not: two builders would double compile time. All builders sample
        emitters as the first one's pre-pass found.
        """
        kind = diffuse, photons
        if self._builder is None or self._builder[0] != kind:
            self._builder = self._whole = None
            tables = self._measured_tables(photons)
            builder = SceneBuilder(
                self.scene, self.atlas.uv2, diffuse=diffuse, measured=tables, sampling=self._sampling,
                unmapped=self._unmapped,
            )  # fmt: skip
            if self._sampling is None:
                balance_emitters(builder, self._effort)
                self._sampling = builder.sampling()
            self._builder = kind, builder
        return self._builder[1]

    def _measured_tables(self, photons: bool) -> Mapping[str, Lookup]:
        """Tables that replace materials, by material name; for photons with light and viewer swapped.

        The renderer shows a fit of the table, the material's document.
        """
        files = self.scene.measured
        used = {o.material for o in self.scene.objects} & set(files)
        tell: Any = self.progress  # hashable, which its protocol does not state
        return {name: _lookup(files[name], sha256_of(files[name]), photons, tell) for name in sorted(used)}

    def whole(self, *, diffuse: bool, photons: bool = False) -> Any:
        """mi.Scene of that builder, with all objects."""
        builder = self.builder(diffuse=diffuse, photons=photons)
        if self._whole is None:
            self._whole = builder.build()
        return self._whole

    @cached_property
    def sun(self) -> Sun | None:
        """The sun whose direct light is removed from the light map."""
        return None if self._found_sun is None else Sun(self._found_sun)

    @cached_property
    def _found_sun(self) -> FoundSun | None:
        return sun_of(self.scene) if self._sun_left_out else None

    def unseen(self, *, diffuse: bool, lamps: bool = True) -> Unseen | None:
        """That sun with the emitters of `whole(diffuse=diffuse)`, for sampling at points of the light map.

        Emitters do not include lamps, whose light is `lamp_light`, unless `lamps` is false.
        """
        without = self.lamps if lamps else ()
        if self._found_sun is None and not without:
            return None
        builder, whole = self.builder(diffuse=diffuse), self.whole(diffuse=diffuse)
        if self._sky_without is None:
            bare = self._found_sun and sky_without(self._found_sun, builder, whole, self._effort)
            self._sky_without = (builder.environment if self._found_sun is None else bare,)
        first = FirstLight(builder, whole, self._found_sun, *self._sky_without, without)
        return NoSun(first) if self._found_sun is None else Sun(self._found_sun, first)

    @cached_property
    def lamps(self) -> tuple[int, ...]:
        """Numbers of the scene's lights whose light on the light map is `lamp_light`."""
        return self.scene.lamps if self._lamps_apart else ()

    @cached_property
    def apart(self) -> frozenset[str]:
        """Names of the openings that renderers draw as lamps, which probes and light fields leave out."""
        drawn = {self.lamps[place] for place in self.drawn_lamps} if self.scene.openings else set()
        return frozenset(name for number, name in self.scene.openings.items() if number in drawn)

    def lamp_rays(self, lamps: Sequence[tuple[int, int]], factors: Floats | None = None) -> LampRays:
        """Shadow rays to some of the scene's lights, by number and light group, times factors (G, 3) by group."""
        numbers, of_lamps = [number for number, _ in lamps], None if factors is None else factors[[g for _, g in lamps]]
        return LampRays(self.builder(**self._at_hand), self.bare, numbers, of_lamps)

    @property
    def bare(self) -> Any:
        """mi.Scene of the builder at hand without openings of luminaires."""
        builder, whole = self.builder(**self._at_hand), self.whole(**self._at_hand)
        if self._bare is None or self._bare[0] is not whole:
            self._bare = whole, builder.without(builder.scene.openings.values(), whole)
        return self._bare[1]

    @cached_property
    def drawn_lamps(self) -> tuple[int, ...]:
        """The lamps that a renderer draws by pixel, as places in `lamps`, the most important first."""
        if not self.lamps:
            return ()
        return drawn_of(LampPoints(self.lamp_rays(self._grouped_lamps), *self.in_view(1.0)).detail())

    @property
    def _grouped_lamps(self) -> list[tuple[int, int]]:
        """The `lamps` with their light groups."""
        return [(number, self.sorted_lights.of_lights[number]) for number in self.lamps]

    def lamp_light(self, sign: float) -> LampLight:
        """The direct light of lamps on the normals' side (sign +1) or the other (-1)."""
        if sign not in self._lamp_light:
            self.progress(0, 1, "lamps")
            points = LampPoints(self.lamp_rays(self._grouped_lamps), *self.in_view(sign))
            groups = [group for _, group in self._grouped_lamps]
            self._lamp_light[sign] = points.light(groups, len(self.sorted_lights.groups), self.drawn_lamps)
        return self._lamp_light[sign]

    def cache(
        self, irradiance: Floats, irradiance_back: Floats | None, factor_of_sun: Triple = WHITE,
        lamps: LampRays | None = None,
    ) -> LightMapCache:  # fmt: skip
        """A light map (H, W, 3) as radiance cache of the scene without diffuse terms, including the sun it lacks.

        It may lack the direct light of `lamps` as well.
        """
        builder = self.builder(diffuse=False)
        sun = None if self.sun is None else SunRays(self.sun, self.whole(diffuse=False), factor_of_sun)
        return LightMapCache(builder, irradiance, irradiance_back, sun, self._drawn_light, lamps)

    @cached_property
    def _drawn_light(self) -> list[Floats]:
        """By side with a light map, the direct light (H, W, 3) of lamps that renderers draw; empty without lamps."""
        signs = (1.0, -1.0) if self.lamps and any(self.two_sided) else (1.0,) if self.lamps else ()
        return [self.lamp_light(sign).drawn.sum(axis=0, dtype=np.float32) for sign in signs]

    @cached_property
    def sorted_lights(self) -> SortedLights:
        """The light groups of the scene, with its sun."""
        found, lights = self._found_sun, enumerate(self.scene.lights)
        suns = [] if found is None else [number for number, light in lights if is_sun(light, found)]
        return sorted_lights(self.scene, suns, sun_in_sky=found is not None and found.picture is not None)

    def tally(self, *, diffuse: bool, direct: Direct | None) -> GroupTally:
        """Separates the light of paths in `whole(diffuse=diffuse)` by group; `direct` light separately as well."""
        return GroupTally(self._sorting(diffuse=diffuse), direct)

    def mixed(self, factors: Floats, *, diffuse: bool) -> MixTally:
        """Likewise, the sum of all groups times their factors (n, 3)."""
        return MixTally(self._sorting(diffuse=diffuse), factors)

    def _sorting(self, *, diffuse: bool) -> Sorting:
        return Sorting(self.sorted_lights, self.builder(diffuse=diffuse), self.sun)

    def set_materials(self, scene: Scene) -> None:
        """Take the materials and textures of another scene with the same objects and lights.

        Every mi.Scene made before has them too, so caches and tallies must be made anew.
        """
        self.scene = replace(self.scene, materials=scene.materials, textures=scene.textures)
        self.atlas = replace(self.atlas, scene=self.scene)
        if self._builder is not None and not self._builder[1].set_materials(self.scene):
            self._builder = self._whole = None
        found, panes = self._found_sun, panes_of(self.scene)
        if found is not None and found.record.panes != panes:
            self._found_sun = replace(found, record=found.record.model_copy(update={"panes": panes}))
            self.__dict__.pop("sun", None)

    def grouped_cache(self, irradiance: Floats, irradiance_back: Floats | None) -> GroupedCache:
        """`cache` for the light maps (n, H, W, 3) of groups."""
        sun = None if self.sun is None else SunRays(self.sun, self.whole(diffuse=False))
        of_sun = self.sorted_lights.sun
        return GroupedCache(self.builder(diffuse=False), irradiance, irradiance_back, sun, of_sun)

    @cached_property
    def texels(self) -> Texels:
        return texels_of(self.merged, self.atlas.width, self.atlas.height)

    @property
    def crossed(self) -> Flags:
        """(T,) faces of objects whose backs have a light map too."""
        return self._two_sided

    @cached_property
    def cuts(self) -> Cuts:
        return cuts_of(self.merged, self.atlas.width, self.atlas.height)

    @cached_property
    def labels(self) -> Indices:
        """(H, W) chart of each texel."""
        return chart_labels(self.merged, self.texels)

    def lit_sides(self, sign: float) -> Sides:
        """Points that light can reach, on the normals' side (sign +1) or the other (-1)."""
        if sign not in self._sides:
            ours = np.ones(self.texels.face.shape, bool) if sign > 0 else self._two_sided[self.texels.face]
            self.progress(0, 1, "visibility")
            kind = self._at_hand
            solids = SolidTest(self.builder(**kind), self.whole(**kind))
            within = self._of_points(ours, sign, solids.embedded)
            self._sides[sign] = Sides(self.texels, sign, ours & ~within)
        return self._sides[sign]

    def in_view(self, sign: float) -> tuple[Sides, Indices]:
        """`lit_sides` without hidden points if a texel has others, and `labels` with BEYOND added for hidden texels."""
        if sign not in self._views:
            sides = self.lit_sides(sign)
            self.progress(0, 1, "visibility")
            whole = self.whole(**self._at_hand)
            found = self._of_points(sides.valid, sign, lambda p, n: seen(whole, self.places, p, n))
            if sign < 0:
                sides = replace(sides, valid=sides.valid & (found | self._crossed[self.texels.face]))
            valid, labels = without_hidden(self.texels, sides.valid, found, self.labels)
            self._views[sign] = replace(sides, valid=valid), labels
        return self._views[sign]

    @cached_property
    def places(self) -> Floats:
        """(n, 3) possible positions of viewers."""
        return viewing_places(self.scene, self.whole(**self._at_hand))

    @property
    def _at_hand(self) -> dict[str, bool]:
        """The kind of scene already built, if any: the shapes of all kinds are the same."""
        diffuse, photons = self._builder[0] if self._builder else (False, False)
        return {"diffuse": diffuse, "photons": photons}

    def _of_points(self, asked: Flags, sign: float, test: Callable[[Floats, Floats], Flags]) -> Flags:
        """(K, POINTS) results of a test of points (n, 3) and triangle normals (n, 3), where `asked`."""
        t = self.texels
        same = (t.face[:, :, None] == t.face[:, None]) & (t.positions[:, :, None] == t.positions[:, None]).all(axis=-1)
        first = np.argmax(same & asked[:, None], axis=2)  # repeated points are tested once
        once = asked & (first == np.arange(POINTS))
        found = np.zeros(asked.shape, bool)
        if once.any():  # a scene may have nothing on this side; Dr.Jit has no empty arrays
            found[once] = test(t.positions[once], sign * t.flat[once])
        return np.asarray(np.take_along_axis(found, first, axis=1) & asked)


@lru_cache(maxsize=1)
def _unpickled(state: bytes) -> TracedScene:
    """The same for all work on one scene, so that its kernels and trees are made once."""
    made, *found = pickle.loads(state)
    traced = made()
    traced._take(*found)
    return cast(TracedScene, traced)


@lru_cache(maxsize=8)
def _lookup(file: Path, digest: str, photons: bool, progress: Any) -> Lookup:
    return lookup_of(load(file), None, progress, reverse=photons)
