"""Bakes: scenes become stores."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lambent.api.progress import Wanted, progress_of
from lambent.api.scenes import Scene
from lambent.api.stores import Note, Store
from lambent.core.discovery import known, modules_in
from lambent.core.errors import UserError
from lambent.core.extras import needing_extras

if TYPE_CHECKING:
    from lambent.baking.interreflection.proposal import Proposal
    from lambent.baking.interreflection.settings import Bounces
    from lambent.baking.running.workers import Workers
    from lambent.core.progress import Progress
    from lambent.editing.session.session import Session
    from lambent.scenes.scene import Scene as Contents

INTERREFLECTION = "interreflection"


@dataclass(frozen=True)
class Interreflection:
    """How the interreflections of edited views are baked.

    Attributes
    ----------
    series : str
        Bands per curve at the first surface, the second, ...
    samples : int
        Paths per pixel; paths in the store count.
    fixed, editable : sequence of str
        Materials that will not be edited, and that will be, proposed or not.
    merge : bool
        Whether materials that look the same are merged, to save memory.
    diffuse_seen : bool
        Whether surfaces seen in others are treated as diffuse.
    """

    series: str = "64,1,1,1"
    samples: int = 1024
    fixed: Sequence[str] = ()
    editable: Sequence[str] = ()
    merge: bool = False
    diffuse_seen: bool = False


def bake(
    scene: Scene | str | Path,
    folder: str | Path,
    *,
    quality: str = "preview",
    only: Collection[str] | None = None,
    resume: bool = True,
    seed: int = 0,
    light_map: str | None = None,
    probes: str | None = None,
    light_groups: str | None = None,
    light_fields: str | None = None,
    light_field_mb: float | None = None,
    views: Sequence[str] = (),
    session: str | Path | None = None,
    interreflection: Interreflection | None = None,
    on: int | str | None = None,
    note: Note | None = None,
    progress: Wanted = None,
) -> Store:
    """Bake a scene into a store, or bring a store up to date; an interrupted bake resumes.

    Options that are not given are as in the store.

    Parameters
    ----------
    scene : Scene, str or Path
        A scene, or its file or "builtin:NAME".
    folder : str or Path
        Of the store, created if needed.
    quality : {"draft", "preview", "normal", "final"}
    only : collection of str, optional
        Kinds of arrays, with those that they need; by default all that need no `views`.
    resume : bool
        False bakes everything again.
    seed : int
        The same seed gives the same store.
    light_map : {"paths", "photons"}, optional
    probes : {"cached", "traced"}, optional
        Whether probes show the light map, or all paths are traced.
    light_groups : {"none", "scene"}, optional
        Whether the light of each light group is stored, to be dimmed later.
    light_fields : str, optional
        Objects that get a light field: names with * and ?, "scene", "auto" or "none".
    light_field_mb : float, optional
        Memory budget of "auto".
    views : sequence of str
        "CAMERA" or "CAMERA:WIDTHxHEIGHT" of views whose materials will be edited.
    session : str or Path, optional
        Session of edits, whose view is baked with its materials and its environment.
    interreflection : Interreflection, optional
        For `only` with "interreflection".
    on : int or str, optional
        A number of processes of this machine, or the address of a Dask scheduler, such as "tcp://10.0.0.1:8786", whose
        workers trace light maps, probes and interreflections; by default this process.
    note : callable, optional
        Called with sentences about what is baked for interreflections.
    progress : bool or callable, optional
        As of `Table.fit`.

    Raises
    ------
    UserError
        If an option is unknown, the scene has no objects or is too large, or no path tracing engine works.
    KeyboardInterrupt
        Finished work stays in the folder.
    """
    folder, wanted = Path(folder), interreflection or Interreflection()
    with needing_extras(), progress_of(progress) as bar:
        from lambent.baking.bake import bake as baked

        request = _Request.of(scene, folder, views, session)
        request.check(only, interreflection, on)
        what, bounces, watch = request.scene, _bounces(wanted, request.scene), None
        if INTERREFLECTION in (only or ()):
            what, bounces = request.continued_or_proposed(folder, wanted, note or (lambda text: None), bar)
            watch = request.watch(what, folder, bounces, bar)
        with _workers(on, bar) as workers:
            store = baked(
                what, folder, quality=quality, only=only, resume=resume, seed=seed, light_map=light_map, probes=probes,
                light_groups=light_groups, light_fields=light_fields, light_field_mb=light_field_mb, bounces=bounces,
                workers=workers, progress=watch.progress if watch is not None else bar, **request.edited,
            )  # fmt: skip
        if watch is not None:
            watch.note(store)
        store.close()
    return Store(folder)


def propose(
    scene: Scene | str | Path,
    *,
    views: Sequence[str] = (),
    session: str | Path | None = None,
    interreflection: Interreflection | None = None,
    store: str | Path | None = None,
    progress: Wanted = None,
) -> list[Proposal]:
    """The materials that interreflections would cover, with time and memory, for each view.

    Parameters as of `bake`; `store` adds the views saved there.
    """
    with needing_extras(), progress_of(progress) as bar:
        request = _Request.of(scene, None if store is None else Path(store), views, session)
        return request.proposed(interreflection or Interreflection(), bar)


def scene_of_session(scene: str | Path, session: str | Path | None, crease_deg: float | None = None) -> Scene:
    """Read a scene with the crease angle of a session of edits, where none is given."""
    from lambent.editing.session.session import Session

    if session is not None and crease_deg is None:
        crease_deg = Session.open(Path(session)).document.crease_deg
    return Scene.read(scene, crease_deg)


@dataclass(frozen=True)
class _Request:
    """A scene with its merged materials, arguments of the bake for edited views, and names of edited materials."""

    scene: Contents
    edited: dict[str, Any]
    changed: frozenset[str]

    @classmethod
    def of(
        cls, scene: Scene | str | Path, store: Path | None, names: Sequence[str], session: str | Path | None
    ) -> _Request:
        from lambent.baking.transport.view import view_named
        from lambent.editing.session.session import Session
        from lambent.store.kept.views import read_views

        read = scene if isinstance(scene, Scene) else scene_of_session(scene, session)
        what = read.contents
        _check_lit(what)
        saved = read_views(store).cameras if store is not None else ()
        views = [view_named(name, (*saved, *what.cameras)) for name in names]
        if session is None:
            return cls(what, {"views": views}, frozenset())
        return cls._of_session(Session.open(Path(session)), Path(session), what, views)

    @classmethod
    def _of_session(cls, session: Session, file: Path, scene: Contents, views: list[Any]) -> _Request:
        from lambent.baking.transport.view import View

        document = session.document
        merged = [*document.merged, *document.merged.values()]
        for field, names in (("materials", document.materials), ("merged", merged)):
            for name in names:
                known("material", name, scene.materials, file=file, field=field)
        edited = {
            "views": [*views, View(document.camera, *document.size)],
            "editables": {name: session.original(name) for name in document.materials},
            "environment": session.environment,
        }
        changed = frozenset(name for name, one in document.materials.items() if one.now != one.start)
        return cls(scene.merged(document.merged), edited, changed)

    def check(self, only: Collection[str] | None, wanted: Interreflection | None, on: int | str | None) -> None:
        """Raise `UserError` for views that no kind uses, and for settings of interreflections without them."""
        from lambent.baking import artefacts
        from lambent.baking.running.cluster import check_count

        if on is not None:
            check_count(on)
        if self.edited["views"] and only is not None and not {*only} & {*modules_in(artefacts, having="OF_VIEWS")}:
            raise UserError("no kind uses the given view", field="--only", got=", ".join(only), expected="transport")
        if INTERREFLECTION in (only or ()):
            return
        given = [option for option in ("fixed", "editable", "merge") if wanted is not None and getattr(wanted, option)]
        if given:
            hint = "add --only interreflection"
            raise UserError("applies to interreflections only", field=f"--{given[0]}", hint=hint)

    def proposed(self, wanted: Interreflection, progress: Progress) -> list[Proposal]:
        """A proposal for each view."""
        from lambent.baking.interreflection.proposal import propose_all

        views, light = self.edited["views"], self.edited.get("environment")
        if not views:
            raise UserError("is missing", field="--view", hint="name a camera, or a session with --edit")
        bounces = _bounces(wanted, self.scene)
        return propose_all(
            self.scene if light is None else replace(self.scene, environment=light), views, bounces,
            merging=wanted.merge, kept=self.changed.union(wanted.editable) - bounces.fixed,
            editables=self.edited.get("editables"), progress=progress,
        )  # fmt: skip

    def continued_or_proposed(
        self, store: Path, wanted: Interreflection, note: Note, progress: Progress
    ) -> tuple[Contents, Bounces]:
        """Scene and bounces as in the store, if it has some and nothing else is chosen; else as proposed."""
        from lambent.baking.interreflection.proposal import held_by
        from lambent.baking.interreflection.series import used_materials

        views, bounces = self.edited["views"], _bounces(wanted, self.scene)
        if views and not (bounces.fixed or wanted.editable or wanted.merge):
            held = [held_by(store, self.scene, view, bounces.series) for view in views]
            if (first := held[0]) is not None and all(one == first for one in held):
                note(f"continuing with the materials that the store has: {', '.join(sorted(first.edited))}")
                scene = first.merged(self.scene)
                return scene, replace(bounces, fixed=frozenset(used_materials(scene)) - first.edited)
        found = self.proposed(wanted, progress)
        for one in found:
            note("\n".join(one.lines()))
        return found[0].merged(self.scene), found[0].bounces

    def watch(self, scene: Contents, store: Path, bounces: Bounces, progress: Progress) -> Any:
        """The recorder of the noise of interreflections in the store."""
        from lambent.baking.interreflection.series import used_materials
        from lambent.editing.interreflection.noise import PassNoise
        from lambent.materials.factored.of_lobes import of_material

        given = self.edited.get("editables", {})
        materials = {name: given.get(name) or of_material(scene.materials[name]) for name in used_materials(scene)}
        shots = [(view.camera, (view.width, view.height)) for view in self.edited["views"]]
        return PassNoise(store, shots, materials, bounces.samples, progress)


def _bounces(wanted: Interreflection, scene: Contents) -> Bounces:
    """The settings of the bake; `UserError` for a material that is unknown, or both fixed and editable."""
    from lambent.baking.interreflection.settings import Bounces

    for option, names in (("--fixed", wanted.fixed), ("--editable", wanted.editable)):
        for name in names:
            known("material", name, scene.materials, field=option)
    if both := sorted({*wanted.fixed} & {*wanted.editable}):
        raise UserError(
            "material is both --fixed and --editable", field="--editable", got=both[0], hint="leave out one"
        )
    return Bounces(Bounces.of_text(wanted.series), wanted.samples, frozenset(wanted.fixed), wanted.diffuse_seen)


def _check_lit(scene: Contents) -> None:
    """Raise `UserError` before the bake if every picture of the scene would be black or impossible."""
    shines = scene.environment is not None or scene.lights or any(any(o.emission) for o in scene.objects)
    if not shines or not scene.cameras:
        lacks, section = ("has no light", "[environment]") if not shines else ("has no camera", "[[cameras]]")
        raise UserError(lacks, field=scene.name, hint=f"add {section} to its scene.toml")


@contextmanager
def _workers(on: int | str | None, progress: Progress) -> Iterator[Workers | None]:
    """The workers that trace; None: this process."""
    if on is None:
        yield None
        return
    from lambent.baking.running.cluster import opened

    with opened(on, progress) as workers:
        yield workers
