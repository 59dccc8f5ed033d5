"""The bake context: scene, store, settings, and shared objects, each created once.

A kind of artefact is a module of `artefacts/`, found by its file:

    KIND = "light_map"           the file's name, and the kind's name in the store
    NEEDS = ("geometry",)        kinds whose arrays it reads, baked before it
    SETTINGS = {...}             optional: a dataclass for each QualityName
    def keys(context)            {array name: key} of every array it writes, including samples kept for a later bake
    def bake(context)            writes the stale arrays; imports Mitsuba, whose engine is chosen by then, only here
    OF_VIEWS = True              optional: nothing is baked without views
    ON_REQUEST = True            optional: baked only if requested by name
    def describe(context)        optional: writes documents, which have no keys; called by every bake
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol

from lambent.baking.engine import engine
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.methods import LightMapMethod
from lambent.baking.quality import Quality
from lambent.baking.running.timing import Timed, untimed
from lambent.baking.running.watch import Watch
from lambent.baking.running.workers import InProcess, Workers
from lambent.baking.surfaces.atlas import Atlas, separated
from lambent.baking.surfaces.backs import backs_of, crossed_by_light
from lambent.baking.surfaces.visible_triangles import TriangleVisibility
from lambent.baking.transport.view import View
from lambent.core.progress import Progress, silent
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable
from lambent.scenes.scene import ImageEnvironment, Scene
from lambent.store.store import Array, Store, Writer

if TYPE_CHECKING:
    from lambent.baking.tracing.traced_scene import TracedScene
    from lambent.baking.transport.view_tracer import ViewTracer

GEOMETRY = ("positions", "normals", "tangents", "uv", "uv2", "faces")


class Artefact(Protocol):
    """A module of `artefacts/`."""

    KIND: str
    NEEDS: tuple[str, ...]

    def keys(self, context: BakeContext) -> dict[str, str]: ...
    def bake(self, context: BakeContext) -> None: ...


@dataclass
class BakeContext:
    """One bake: the scene in baked form, the store, and objects that several artefacts share.

    `scene` has its textures as stored, and objects divided into parts with their own probes; `undivided` has whole
    objects, as views show them. `editables` replace the terms of materials' documents; `bounces` has the settings of
    interreflections, and `environment` lights the views instead of the scene's own. `workers` run jobs in other
    processes. `timed(step)` times a step that is not a kind of artefact. `watch` is notified of finished artefacts.
    `sight` is what viewers of `scene` see, if already computed.
    """

    scene: Scene
    store: Store
    artefacts: Mapping[str, Artefact]
    quality: Quality
    methods: Mapping[str, str]
    seed: int = 0
    progress: Progress = silent
    undivided: Scene | None = None
    views: Sequence[View] = ()
    editables: Mapping[str, Editable] = field(default_factory=dict)
    environment: ImageEnvironment | None = None
    bounces: Bounces = field(default_factory=Bounces)
    workers: Workers = field(default_factory=InProcess)
    timed: Timed = untimed
    watch: Watch = field(default_factory=Watch)
    sight: TriangleVisibility | None = None
    _keys: dict[str, dict[str, str]] = field(default_factory=dict)

    def settings(self, kind: str) -> Any:
        """The settings of a kind of artefact at this bake's quality, an instance of the kind's dataclass."""
        return self.quality.settings(kind, getattr(self.artefacts[kind], "SETTINGS", {}))

    def keys(self, kind: str) -> dict[str, str]:
        """The key of every array that a kind of artefact writes, by the array's name."""
        if kind not in self._keys:
            self._keys[kind] = self.artefacts[kind].keys(self)
        return self._keys[kind]

    def begun(self, kind: str) -> set[str]:
        """Names of the arrays of a kind that the store has, completely or partly, under their current keys."""
        keys = self.keys(kind)
        return {a.name for a in self.store.artefacts() if keys.get(a.name) == a.key}

    def stale(self, kind: str) -> set[str]:
        """Names of the arrays of a kind that are absent, partial or baked from other inputs."""
        return self.keys(kind).keys() - {name for name in self.begun(kind) if name in self.store}

    def put(self, kind: str, name: str, array: Array, meta: Mapping[str, Any] | None = None) -> None:
        """Write an array of a kind."""
        self.store.put(name, kind, array, key=self.keys(kind)[name], meta=meta)

    def samples(self, kind: str, name: str, shape: Sequence[int], chunks: Sequence[int]) -> Writer:
        """Writer of float32 samples, which stay in the store, so that an interrupted bake continues with them."""
        key = self.keys(kind)[name]
        return self.store.begin(name, "raw", shape, chunks, "float32", key=key, meta=self.provenance())

    def editable(self, material: str) -> Editable:
        """The terms and curves of a material of the scene."""
        return self.editables.get(material) or of_material(self.scene.materials[material])

    def provenance(self, **more: Any) -> dict[str, Any]:
        """Meta of an array: quality, seed, engine, and more."""
        return {"quality": self.quality.name, "seed": self.seed, "engine": engine().variant, **more}

    @cached_property
    def geometry(self) -> dict[str, Array]:
        """The arrays geometry/* of the store."""
        return {name: self.store.read(f"geometry/{name}") for name in GEOMETRY}

    @cached_property
    def atlas(self) -> Atlas:
        """The scene with the vertices and light map coordinates of `geometry`."""
        width, height = self.store.artefact("geometry/uv2").meta["light_map_size"]
        return separated(self.scene, self.geometry, width, height)

    @cached_property
    def two_sided(self) -> list[bool]:
        """By object, whether its back has a light map too: because light crosses it, or viewers see it from behind."""
        backs = backs_of(self.store)
        return [one or o.name in backs for o, one in zip(self.scene.objects, crossed_by_light(self.scene), strict=True)]

    @cached_property
    def traced(self) -> TracedScene:
        """The scene for Mitsuba, with the points of its light map."""
        from lambent.baking.tracing.traced_scene import TracedScene

        apart = self.methods["light_map"] != LightMapMethod.photons
        return TracedScene(self.atlas, self.geometry, self.two_sided, self.progress, lamps_apart=apart)

    @cached_property
    def in_views(self) -> Scene:
        """The scene with whole objects, lit as in the views."""
        scene = self.undivided or self.scene
        return scene if self.environment is None else replace(scene, environment=self.environment)

    @cached_property
    def view_tracer(self) -> ViewTracer:
        """The scene of the views for tracing, with its lights."""
        from lambent.baking.transport.view_tracer import ViewTracer

        return ViewTracer(self.in_views, self.editables)
