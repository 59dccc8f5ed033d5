"""Propose which materials to edit, fix and merge in a view with interreflections, with the cost of the bake.

    proposal = propose(scene, View(scene.cameras[0], 512, 512), Bounces((64, 1, 1, 1), samples=4096))
    print("\\n".join(proposal.lines()))
    bake(proposal.merged(scene), folder, only={"interreflection"}, views=[view], bounces=proposal.bounces)

Costs are measured: a few points of each material get all their samples, then one batch of a tile is timed.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lambent.baked.transport.tails import FIXED, Tails
from lambent.baking.engine import engine
from lambent.baking.interreflection.series import bins_of, tails_of, used_materials
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.running.keys import material_inputs
from lambent.baking.transport.view import View
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable
from lambent.scenes.looks.textures import prepared
from lambent.scenes.scene import Scene
from lambent.store.source import materials_in_views
from lambent.store.store import MANIFEST, Store

if TYPE_CHECKING:
    from lambent.baking.interreflection.trial import Cost

SMALL = 0.01  # share of the view, and of reflected light, below which a material is fixed
MOST_BYTES = 2 << 30  # of a store, uncompressed
ENTRY_BYTES = (
    6  # of an entry that is edited: its light, and a step of one byte or two (editing.interreflection.entries)
)
LISTED = 10  # fixed materials listed in a table
MOST_CELLS = 1 << 22  # bands times tails per point: each thread has a row of them


@dataclass(frozen=True)
class Row:
    """A material in the proposal.

    Attributes
    ----------
    role : {'edited', 'fixed'}
    bands : int
        Of all its terms.
    points : int
        Pixels that show it.
    in_view : float
        Their share of the view.
    passed_on : float
        Share of the light over two surfaces whose second surface is of this material.
    cells, entries : int, float
        Bands times tails, and the expected number of nonzero ones per point.
    disk_bytes : int
    seconds : float
    """

    material: str
    role: str
    points: int
    in_view: float
    passed_on: float
    bands: int = 1
    cells: int = 0
    entries: float = 0.0
    disk_bytes: int = 0
    seconds: float = 0.0

    @property
    def weight(self) -> float:
        """Visual effect of an edit of the material."""
        return self.in_view + self.passed_on


@dataclass(frozen=True)
class Proposal:
    """What to bake, and its costs.

    Attributes
    ----------
    bounces : Bounces
        With the materials to fix.
    rows : tuple of Row
        The remaining materials, most important first.
    same, alike : mapping of str to str
        Materials to merge with one that looks the same, and candidates for that.
    bake_bytes, edit_bytes : int
        Memory of the bake beyond the scene's, and of the tiles during editing.
    begin_s : float
        Seconds until the first path.
    reasons : tuple of str
        Why materials are fixed that are not small.
    """

    bounces: Bounces
    rows: tuple[Row, ...]
    same: Mapping[str, str]
    alike: Mapping[str, str]
    bake_bytes: int
    edit_bytes: int
    begin_s: float = 0.0
    reasons: tuple[str, ...] = field(default=())

    @property
    def edited(self) -> frozenset[str]:
        """Names of the materials that are edited."""
        return frozenset(row.material for row in self.rows if row.role == "edited")

    @property
    def disk_bytes(self) -> int:
        return sum(row.disk_bytes for row in self.rows)

    @property
    def seconds(self) -> float:
        """Seconds of the bake on one machine."""
        return self.begin_s + sum(row.seconds for row in self.rows)

    @property
    def samples_per_s(self) -> float:
        return sum(row.points for row in self.rows) * self.bounces.samples / max(self.seconds, 1e-9)

    def merged(self, scene: Scene) -> Scene:
        """The scene after merging materials."""
        return scene.merged(self.same)

    def said(self) -> dict[str, Any]:
        """For JSON; `Proposal.of` is the inverse."""
        said = asdict(replace(self, bounces=Bounces()))
        return {**said, "bounces": self.bounces.said(), "disk_bytes": self.disk_bytes, "seconds": self.seconds}

    @classmethod
    def of(cls, said: Mapping[str, Any]) -> Proposal:
        own = {key: value for key, value in said.items() if key not in ("disk_bytes", "seconds")}
        rows, reasons = tuple(Row(**row) for row in said["rows"]), tuple(said["reasons"])
        return cls(**{**own, "bounces": Bounces.of(said["bounces"]), "rows": rows, "reasons": reasons})

    def lines(self) -> list[str]:
        """A table of the materials, and the totals."""
        heads = ("material", "role", "in view", "passes on", "bands", "entries", "disk", "time")
        left_out = [row for row in self.rows if row.role == "fixed"][LISTED:]
        table = [
            (
                row.material, row.role, f"{row.in_view:.1%}", f"{row.passed_on:.1%}", str(row.bands),
                f"{row.entries:.0f} of {row.cells}", bytes_said(row.disk_bytes), time_said(row.seconds),
            )
            for row in self.rows if row not in left_out
        ]  # fmt: skip
        widths = [max(len(line[k]) for line in (heads, *table)) for k in range(len(heads))]
        lines = ["  ".join(text.ljust(n) for text, n in zip(line, widths, strict=True)) for line in (heads, *table)]
        if left_out:
            sums = sum(row.in_view for row in left_out), sum(row.passed_on for row in left_out)
            lines.append(f"and {len(left_out)} more are fixed: {sums[0]:.1%} in view, {sums[1]:.1%} passed on")
        lines += [f"{name} is merged with {other}: they look the same" for name, other in self.same.items()]
        lines += [f"{name} looks like {other}: merged, they need less" for name, other in self.alike.items()]
        return [line.rstrip() for line in (*lines, *self.reasons, *self.sums())]

    def sums(self) -> list[str]:
        """Time and memory, in two lines."""
        series = ",".join(map(str, self.bounces.series))
        return [
            f"{series} with {self.bounces.samples} samples: {time_said(self.seconds)} "
            f"at {self.samples_per_s:.2g} samples/s",
            f"{bytes_said(self.disk_bytes)} on disk, {bytes_said(self.bake_bytes)} of memory to bake, "
            f"{bytes_said(self.edit_bytes)} to edit",
        ]


def propose(
    scene: Scene,
    view: View,
    bounces: Bounces | None = None,
    *,
    editables: Mapping[str, Editable] | None = None,
    kept: Collection[str] = (),
    merging: bool = True,
    most_bytes: int = MOST_BYTES,
    progress: Progress = silent,
) -> Proposal:
    """Propose which materials to edit, fix and merge, with the costs of the bake.

    Materials are fixed if `bounces` fixes them, or if they are small in both the view and reflected light. If the store
    would exceed `most_bytes`, materials that look the same are merged, then the least important ones are fixed until it
    fits.

    Parameters
    ----------
    scene
        Lit as in the bake.
    editables
        As in `bake`: terms and curves that replace those of documents. Such materials are not merged.
    kept
        Materials to edit at any cost.
    merging
        Whether materials may be merged.
    most_bytes
        Of a store, uncompressed.

    Raises
    ------
    UserError
        If the view shows nothing, or no path tracing engine works.
    """
    engine()  # before Mitsuba is imported
    bounces, given = bounces or Bounces(), editables or {}
    scene = replace(scene, textures=prepared(scene.textures))  # as in the bake
    alike = same_materials(scene, keep={*bounces.fixed, *given, *kept})
    found = _proposal(scene, view, bounces, given, kept, most_bytes, progress)
    if not (merging and found.reasons and alike):
        return replace(found, alike=alike)
    return replace(_proposal(scene.merged(alike), view, bounces, given, kept, most_bytes, progress), same=alike)


def propose_all(
    scene: Scene,
    views: Sequence[View],
    bounces: Bounces,
    *,
    kept: Collection[str] = (),
    merging: bool = True,
    **more: Any,
) -> list[Proposal]:
    """One proposal per view, all with the same edited materials: those edited in any of them. See `propose`.

    Materials are merged only for a single view.
    """
    alone = len(views) == 1
    found = [propose(scene, view, bounces, kept=kept, merging=merging and alone, **more) for view in views]
    edited = frozenset[str]().union(*(one.edited for one in found))
    if all(one.edited == edited for one in found):
        return found
    same = replace(bounces, fixed=frozenset(used_materials(scene)) - edited)
    return [propose(scene, view, same, kept=edited, merging=False, **more) for view in views]


@dataclass(frozen=True)
class Held:
    """The edited materials of a store's interreflections, and the merged ones."""

    edited: frozenset[str]
    same: Mapping[str, str]

    def merged(self, scene: Scene) -> Scene:
        """The scene after merging materials."""
        return scene.merged(self.same)


def held_by(folder: Path, scene: Scene, view: View, series: Sequence[int]) -> Held | None:
    """The edited and merged materials of a stored view; None without interreflections of this series."""
    name = view.name("interreflection", "tails")
    if not (folder / MANIFEST).exists():
        return None
    store = Store.open(folder)
    if name not in store or store.artefact(name).meta["series"] != list(series):
        return None
    edited = frozenset(one for one, side in Tails.of(store.artefact(name).meta["tails"]).slots if side != FIXED)
    materials_then, alike = materials_in_views(store), same_materials(scene)
    pairs = {(o.material, materials_then.get(o.name, o.material)) for o in scene.objects}
    return Held(edited, {one: other for one, other in pairs if one != other and alike.get(one) == other})


def _proposal(
    scene: Scene,
    view: View,
    bounces: Bounces,
    given: Mapping[str, Editable],
    kept: Collection[str],
    most_bytes: int,
    progress: Progress,
) -> Proposal:
    from lambent.baking.interreflection.trial import Trial

    known = {name: given.get(name) or of_material(scene.materials[name]) for name in used_materials(scene)}
    trial = Trial(scene, view, known)
    total = sum(trial.shown.values())
    if not total:
        raise UserError("the view shows no surface", field=view.camera.name)
    progress(0, 3, "light that materials pass on")
    passed = trial.passed_on()
    rows = [Row(name, "edited", trial.shown[name], trial.shown[name] / total, passed[name]) for name in known]
    rows.sort(key=lambda row: -row.weight)
    free = [row for row in rows if row.material not in bounces.fixed]
    free.sort(key=lambda row: row.material not in kept)  # otherwise the order is unchanged
    edited = [row.material for row in free if row.material in kept or max(row.in_view, row.passed_on) >= SMALL]
    edited = edited or [row.material for row in free[:1]]
    least = max(1, len({row.material for row in free} & {*kept}))
    reasons: list[str] = []

    def fixing() -> Bounces:
        return replace(bounces, fixed=frozenset(known) - frozenset(edited))

    def cells() -> dict[str, int]:
        tails = len(tails_of(known, fixing()))
        return {name: tails * sum(bins.bands) for name, bins in bins_of(known, fixing()).items()}

    while len(edited) > least and max(cells().values()) > MOST_CELLS:
        reasons.append(f"{edited.pop()} is fixed: rows of more than {MOST_CELLS} numbers a point")
    progress(1, 3, "time and memory")
    costs = trial.costs(fixing())
    while len(edited) > least and _raw(costs, trial.shown) > most_bytes:
        before, left = cells(), 1.0
        while len(edited) > least and _raw(costs, trial.shown) * left > most_bytes:
            reasons.append(f"{edited.pop()} is fixed: the store would have more than {bytes_said(most_bytes)}")
            left = sum(cells().values()) / sum(before.values())  # an estimate: entries in proportion
        progress(2, 3, f"time and memory, {len(edited)} materials edited")
        costs = trial.costs(fixing())
    progress(3, 3, "time and memory")
    size, bins = cells(), bins_of(known, fixing())
    rows = [
        replace(
            row, role="edited" if row.material in edited else "fixed", cells=size[row.material],
            bands=sum(bins[row.material].bands), entries=costs[row.material].entries,
            disk_bytes=round(costs[row.material].disk_bytes * row.points),
            seconds=costs[row.material].seconds(row.points, bounces),
        )
        for row in rows
    ]  # fmt: skip
    memory = trial.bake_bytes(fixing(), costs), round(_held(costs, trial.shown))
    return Proposal(fixing(), tuple(rows), {}, {}, *memory, trial.begin_s, tuple(reasons))


def _raw(costs: Mapping[str, Cost], points: Mapping[str, int]) -> float:
    """Bytes of a store, uncompressed."""
    return sum(cost.raw_bytes * points[name] for name, cost in costs.items())


def _held(costs: Mapping[str, Cost], points: Mapping[str, int]) -> float:
    """Bytes of the entries during editing."""
    return sum(ENTRY_BYTES * cost.entries * points[name] for name, cost in costs.items())


def same_materials(scene: Scene, keep: Collection[str] = ()) -> dict[str, str]:
    """Map each material that scatters light like an earlier one of the scene to that one; `keep` is never mapped."""
    looks: Any = material_inputs(scene)
    look = dict(zip([o.material for o in scene.objects], (repr(one[1]) for one in looks), strict=True))
    first: dict[str, str] = {}
    found = {}
    for name in used_materials(scene):
        if name not in keep:
            other = first.setdefault(look[name], name)
            if other != name:
                found[name] = other
    return found


def bytes_said(count: float) -> str:
    """Bytes as text."""
    unit, size = next((one for one in (("GB", 1e9), ("MB", 1e6)) if count >= one[1]), ("kB", 1e3))
    return f"{count / size:.{1 if count < 10 * size else 0}f} {unit}"


def time_said(seconds: float) -> str:
    """Seconds as text."""
    if seconds < 100:
        return f"{seconds:.0f} s" if seconds >= 1 else "< 1 s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"
