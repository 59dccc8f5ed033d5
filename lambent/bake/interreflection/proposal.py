"""What to edit, to fix and to merge in a view with interreflections, and what that will cost, before it is baked.

    proposal = propose(scene, View(scene.cameras[0], 512, 512), Bounces((64, 1, 1, 1), samples=4096))
    print("\\n".join(proposal.lines()))
    bake(proposal.merged(scene), folder, only={"interreflection"}, views=[view], bounces=proposal.bounces)

Costs are measured: a few points of each material get all their samples, then one batch of a tile is timed.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from lambent.bake.bounces import Bounces
from lambent.bake.engine import engine
from lambent.bake.interreflection.series import bins_of, tails_of, worn
from lambent.bake.keys import material_inputs
from lambent.bake.view import View
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable
from lambent.scenes.scene import Scene

if TYPE_CHECKING:
    from lambent.bake.interreflection.trial import Cost

SMALL = 0.01  # share of the view, and of the light that is passed on, below which a material is fixed
MOST_BYTES = 2 << 30  # of a store, before compression
MOST_CELLS = 1 << 22  # bands times tails of a point: each thread has a row of them


@dataclass(frozen=True)
class Row:
    """A material in the proposal.

    Attributes
    ----------
    role : {'edited', 'fixed'}
    points : int
        Pixels that show it.
    in_view : float
        Their share.
    passed_on : float
        Share of the light of two surfaces whose second surface it is.
    cells, entries : int, float
        Bands times tails, and how many of these a point will have on average.
    disk_bytes : int
    seconds : float
    """

    material: str
    role: str
    points: int
    in_view: float
    passed_on: float
    cells: int = 0
    entries: float = 0.0
    disk_bytes: int = 0
    seconds: float = 0.0

    @property
    def weight(self) -> float:
        """How much an edit of it changes."""
        return self.in_view + self.passed_on


@dataclass(frozen=True)
class Proposal:
    """What to bake, and its costs.

    Attributes
    ----------
    bounces : Bounces
        With the materials to fix.
    rows : tuple of Row
        The materials that stay, the most important first.
    same, alike : mapping of str to str
        Materials to merge with the one that looks the same, and those that might be.
    bake_bytes, edit_bytes : int
        Memory of the bake besides the scene's, and of the tiles while they are edited.
    reasons : tuple of str
        Why materials are fixed that are not small.
    """

    bounces: Bounces
    rows: tuple[Row, ...]
    same: Mapping[str, str]
    alike: Mapping[str, str]
    bake_bytes: int
    edit_bytes: int
    reasons: tuple[str, ...] = field(default=())

    @property
    def disk_bytes(self) -> int:
        return sum(row.disk_bytes for row in self.rows)

    @property
    def seconds(self) -> float:
        """Of the bake, on one machine."""
        return sum(row.seconds for row in self.rows)

    @property
    def samples_per_s(self) -> float:
        return sum(row.points for row in self.rows) * self.bounces.samples / max(self.seconds, 1e-9)

    def merged(self, scene: Scene) -> Scene:
        """The scene with the materials that are merged."""
        return _merged(scene, self.same)

    def lines(self) -> list[str]:
        """A table of the materials, and the sums."""
        heads = ("material", "role", "in view", "passes on", "entries", "disk", "time")
        table = [
            (
                row.material, row.role, f"{row.in_view:.1%}", f"{row.passed_on:.1%}",
                f"{row.entries:.0f} of {row.cells}", _bytes(row.disk_bytes), f"{row.seconds:.0f} s",
            )
            for row in self.rows
        ]  # fmt: skip
        widths = [max(len(line[k]) for line in (heads, *table)) for k in range(len(heads))]
        lines = ["  ".join(text.ljust(n) for text, n in zip(line, widths, strict=True)) for line in (heads, *table)]
        lines += [f"{name} is merged with {other}: they look the same" for name, other in self.same.items()]
        lines += [f"{name} looks like {other}: merged, they need less" for name, other in self.alike.items()]
        series = ",".join(map(str, self.bounces.series))
        lines += [
            *self.reasons,
            f"{series} with {self.bounces.samples} samples: {self.seconds:.0f} s at {self.samples_per_s:.2g} samples/s",
            f"{_bytes(self.disk_bytes)} on disk, {_bytes(self.bake_bytes)} of memory to bake, "
            f"{_bytes(self.edit_bytes)} to edit",
        ]
        return [line.rstrip() for line in lines]


def propose(
    scene: Scene,
    view: View,
    bounces: Bounces | None = None,
    *,
    editables: Mapping[str, Editable] | None = None,
    most_bytes: int = MOST_BYTES,
    progress: Progress = silent,
) -> Proposal:
    """Which materials to edit, fix and merge, with the costs of the bake.

    Fixed are those that `bounces` fixes, and those that are small in the view and in the light that they pass on. Where
    the store would not fit into `most_bytes`, materials that look the same are merged, and then the least important are
    fixed until it fits.

    Raises
    ------
    UserError
        Where the view shows nothing, or no path tracing engine works.
    """
    engine()  # before Mitsuba is imported
    bounces, given = bounces or Bounces(), editables or {}
    alike = same_materials(scene, keep={*bounces.fixed, *given})
    found = _proposal(scene, view, bounces, given, most_bytes, progress)
    if not (found.reasons and alike):
        return replace(found, alike=alike)
    return replace(_proposal(_merged(scene, alike), view, bounces, given, most_bytes, progress), same=alike)


def _proposal(
    scene: Scene, view: View, bounces: Bounces, given: Mapping[str, Editable], most_bytes: int, progress: Progress
) -> Proposal:
    from lambent.bake.interreflection.trial import Trial

    known = {name: given.get(name) or of_material(scene.materials[name]) for name in worn(scene)}
    trial = Trial(scene, view, known)
    total = sum(trial.shown.values())
    if not total:
        raise UserError("the view shows no surface", field=view.camera.name)
    progress(0, 3, "light that materials pass on")
    passed = trial.passed_on()
    rows = [Row(name, "edited", trial.shown[name], trial.shown[name] / total, passed[name]) for name in known]
    rows.sort(key=lambda row: -row.weight)
    free = [row for row in rows if row.material not in bounces.fixed]
    edited = [row.material for row in free if max(row.in_view, row.passed_on) >= SMALL]
    edited = edited or [row.material for row in free[:1]]
    reasons: list[str] = []

    def fixing() -> Bounces:
        return replace(bounces, fixed=frozenset(known) - frozenset(edited))

    def cells() -> dict[str, int]:
        tails = len(tails_of(known, fixing()))
        return {name: tails * sum(bins.bands) for name, bins in bins_of(known, fixing()).items()}

    while len(edited) > 1 and max(cells().values()) > MOST_CELLS:
        reasons.append(f"{edited.pop()} is fixed: rows of more than {MOST_CELLS} numbers a point")
    progress(1, 3, "time and memory")
    costs = trial.costs(fixing())
    while len(edited) > 1 and _raw(costs, trial.shown) > most_bytes:
        before, left = cells(), 1.0
        while len(edited) > 1 and _raw(costs, trial.shown) * left > most_bytes:
            reasons.append(f"{edited.pop()} is fixed: the store would have more than {_bytes(most_bytes)}")
            left = sum(cells().values()) / sum(before.values())  # a guess: entries in proportion
        progress(2, 3, f"time and memory, {len(edited)} materials edited")
        costs = trial.costs(fixing())
    progress(3, 3, "time and memory")
    size = cells()
    rows = [
        replace(
            row, role="edited" if row.material in edited else "fixed", cells=size[row.material],
            entries=costs[row.material].entries, disk_bytes=round(costs[row.material].disk_bytes * row.points),
            seconds=costs[row.material].seconds * row.points,
        )
        for row in rows
    ]  # fmt: skip
    memory = trial.bake_bytes(fixing(), costs), round(_raw(costs, trial.shown))
    return Proposal(fixing(), tuple(rows), {}, {}, *memory, tuple(reasons))


def _raw(costs: Mapping[str, Cost], points: Mapping[str, int]) -> float:
    """Bytes of a store before compression."""
    return sum(cost.raw_bytes * points[name] for name, cost in costs.items())


def same_materials(scene: Scene, keep: Collection[str] = ()) -> dict[str, str]:
    """Materials that scatter light like an earlier one of the scene, with that one's name; `keep` stay themselves."""
    looks: Any = material_inputs(scene)
    look = dict(zip([o.material for o in scene.objects], (repr(one[1]) for one in looks), strict=True))
    first: dict[str, str] = {}
    found = {}
    for name in worn(scene):
        if name not in keep:
            other = first.setdefault(look[name], name)
            if other != name:
                found[name] = other
    return found


def _merged(scene: Scene, same: Mapping[str, str]) -> Scene:
    return replace(scene, objects=tuple(replace(o, material=same.get(o.material, o.material)) for o in scene.objects))


def _bytes(count: float) -> str:
    return f"{count / 1e9:.2f} GB" if count >= 1e9 else f"{count / 1e6:.1f} MB"
