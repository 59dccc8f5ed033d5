"""The editor's state: one material, a measurement to judge it by, another material to compare it with, a fit.

It has no window of its own: `lambent edit` shows it beside a preview, the walk window beside the room. Both draw it
with the same panels, and both change the material through the same `MaterialEdits`, so that undo is shared.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from lambent.core.errors import UserError
from lambent.core.plain import plain_name
from lambent.core.progress import Progress
from lambent.materials.document import Lobe, Material, load_material
from lambent.viewer.editor.documents import kind_of, same_numbers, target_of, typed_path, with_account
from lambent.viewer.editor.measurement import Measurement, read_measurement
from lambent.viewer.editor.readings import incidents_of
from lambent.viewer.editor.restrictions import Restrictions
from lambent.viewer.editor.shown import Shown
from lambent.viewer.editor.work import Work
from lambent.viewer.state import MaterialEdits

Channel = Literal["mean", "RGB", "red", "green", "blue"]
Scale = Literal["cube root", "log", "linear"]
Reference = Literal["nothing", "as loaded", "as saved", "before the last step", "a document"]

CHANNELS: tuple[Channel, ...] = ("mean", "RGB", "red", "green", "blue")
SCALES: tuple[Scale, ...] = ("cube root", "log", "linear")
REFERENCES: tuple[Reference, ...] = ("nothing", "as loaded", "as saved", "before the last step", "a document")
LOBES = ("auto", "1", "2", "3", "4")
DISTRIBUTIONS: tuple[Literal["best", "beckmann", "ggx"], ...] = ("best", "beckmann", "ggx")
METHODS: tuple[Literal["gradient", "grid"], ...] = ("gradient", "grid")


@dataclass
class FitOptions:
    """What a fit is asked for besides the restrictions; `lobes` per side."""

    lobes: str = "1"
    method: Literal["gradient", "grid"] = "gradient"
    distribution: Literal["best", "beckmann", "ggx"] = "best"
    seed: int = 0


@dataclass
class Editor:
    """See the module.

    Attributes
    ----------
    edits, name : MaterialEdits, str
        Where the material lives, and under which name.
    folder : Path
        Where it is saved.
    say : callable
        Shows the user a line.
    origins : list of Material
        As they were loaded or fitted: what their provenance is about.
    """

    edits: MaterialEdits
    name: str
    folder: Path
    say: Callable[[str], None]
    measurement: Measurement | None = None
    metric: str = "cuberoot"
    restrictions: Restrictions = field(default_factory=Restrictions)
    options: FitOptions = field(default_factory=FitOptions)
    chosen: int = 0  # incident direction whose plane is plotted
    channel: Channel = "mean"
    scale: Scale = "cube root"
    reference: Reference = "nothing"
    document: Material | None = None  # to compare with
    saved: Material | None = None
    origins: list[Material] = field(default_factory=list)
    file_name: str = ""
    typed: dict[str, str] = field(default_factory=dict)  # path fields, by what they are for
    fitting: Work | None = None
    loading: Work | None = None
    warnings: tuple[str, ...] = ()  # of the last fit
    linked_roughness: bool = True
    plots_shown: bool = True
    split_across: float = 0.5  # where the picture ends and the disks begin
    split_down: float = 0.6  # where both end and the curves begin
    leave: Callable[[], None] | None = None  # closes the editor, where it is a guest in another window
    open_environment: Callable[[Path], None] | None = None  # what to do with an environment that was dropped
    fit_axes: bool = True  # the axes have yet to take the extent of what they show
    _queue: list[Callable[[], None]] = field(default_factory=list)
    _closed: bool = False
    _keep: bool = False  # what a fit that was stopped has found
    _may_replace: set[Path] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.loaded = self.material
        self.origins.append(self.loaded)
        self.file_name = self.file_name or f"{plain_name(self.material.name)}.json"
        self.shown = Shown()

    # the materials

    @property
    def material(self) -> Material:
        return self.edits.current(self.name)

    @property
    def compared(self) -> Material | None:
        """The material B, where there is one."""
        found = {
            "as loaded": self.loaded,
            "as saved": self.saved,
            "before the last step": self.edits.previous(self.name),
            "a document": self.document,
        }
        return found.get(self.reference)

    @property
    def origin(self) -> Material:
        """What the material was loaded or fitted as; its provenance, which edits keep, tells."""
        about = self.material.provenance
        return next((found for found in reversed(self.origins) if found.provenance == about), self.loaded)

    @property
    def unsaved(self) -> bool:
        """Whether there is something that saving would keep."""
        kept, now = self.saved or self.loaded, self.material
        return now.name != kept.name or not same_numbers(now, kept)

    def choose(self, incident: int) -> None:
        """Plot the plane of another incident direction."""
        self.chosen, self.fit_axes = incident, True

    def change(self, material: Material) -> None:
        """One more moment of the stroke that is under way."""
        self.edits.change(self.name, material)

    def step(self, material: Material) -> None:
        """A whole step of undo."""
        self.edits.end_stroke()
        self.change(material)
        self.edits.end_stroke()

    def adopt(self, material: Material) -> None:
        """Take a material that comes with an account of its own, as a step."""
        self.origins.append(material)
        self.step(material)

    def add_lobe(self, side: Literal["reflection", "transmission"]) -> None:
        before = self.material
        lobe = Lobe(
            side=side, k=(0.5, 0.5, 0.5), mx=0.2, my=0.2, r0=(0.04,) * 3 if side == "reflection" else (0.0,) * 3
        )
        self.step(before.model_copy(update={"lobes": (*before.lobes, lobe)}))

    def remove_lobe(self, index: int) -> None:
        before = self.material
        kept = [i for i in range(len(before.lobes)) if i != index]
        self._with_lobes(tuple(before.lobes[i] for i in kept), kept)

    def turn_lobe(self, index: int, side: Literal["reflection", "transmission"]) -> None:
        """Put a lobe on the other side; its restrictions are dropped."""
        before = self.material
        kept = [i if i != index else -1 for i in range(len(before.lobes))]
        lobes = tuple(o if i != index else o.model_copy(update={"side": side}) for i, o in enumerate(before.lobes))
        self._with_lobes(lobes, kept)

    def _with_lobes(self, lobes: tuple[Lobe, ...], kept: list[int]) -> None:
        before = self.material
        after = before.model_copy(update={"lobes": lobes})
        self.restrictions.follow(before, after, kept)
        self.step(after)

    def queue(self, act: Callable[[], None]) -> None:
        """Do something once the frame is drawn: a panel that shows a list does not change it meanwhile."""
        self._queue.append(act)

    # files

    def open(self, text: str) -> None:
        """Load what the user named: a measurement, a material document, or an environment; or say why not."""
        try:
            path = typed_path(text)
            kind = kind_of(path)
            if kind == "material":
                self._take_document(path)
            elif kind == "environment":
                if self.open_environment is None:
                    raise UserError("environments are for `lambent edit`", file=path)
                self.open_environment(path)
            else:
                self._read(path)
        except UserError as error:
            self.say(f"not loaded: {error}")

    def open_compared(self, text: str) -> None:
        """Load the document to compare with, or say why not."""
        try:
            self.compare_with(load_material(typed_path(text)))
        except UserError as error:
            self.say(f"not loaded: {error}")

    def compare_with(self, document: Material) -> None:
        """Compare with a document from now on."""
        self.document, self.reference = document, "a document"
        self.origins.append(document)

    def _take_document(self, path: Path) -> None:
        material = load_material(path)
        self.adopt(material)
        self.file_name = str(path)
        self._may_replace = {path.resolve()}
        self.say(f"material of {path.name}; undo brings back the one before")

    def _read(self, path: Path) -> None:
        if self.loading is not None:
            raise UserError("another file is being read", file=path)

        def failed(error: UserError) -> None:
            self.say(f"not loaded: {error}")

        self.loading = Work(lambda progress: read_measurement(path, progress), self.show_measurement, failed)

    def show_measurement(self, measurement: Measurement | None) -> None:
        """Judge by this measurement from now on."""
        self.measurement, self.warnings = measurement, ()
        thetas = [incident.theta_deg for incident in incidents_of(measurement.gathered if measurement else ())]
        self.chosen = min(range(len(thetas)), key=lambda i: (abs(thetas[i] - 45), i))
        self.shown, self.fit_axes = Shown(), True

    def save(self) -> None:
        """Write the document, with an account of its numbers; an unrelated file is replaced at the second try."""
        try:
            path = target_of(self.folder, self.file_name)
            if path.exists() and path.resolve() not in self._may_replace:
                self._may_replace.add(path.resolve())
                self.say(f"{path.name} exists: save again to replace it")
                return
            material = self.material
            errors = self.measurement.exact_errors(material) if self.measurement else {}
            with_account(material, self.origin, self.measurement, errors).save(path)
        except (UserError, OSError) as error:
            self.say(f"not saved: {error}")
        else:
            self._may_replace.add(path.resolve())
            self.saved = material
            self.say(f"saved {path}")

    def may_replace(self, path: Path) -> None:
        """Saving to `path` needs no second try: the material came from there."""
        self._may_replace.add(path.resolve())

    def revert(self) -> None:
        """Back to the material as it was loaded, as a step of its own."""
        self.step(self.loaded)

    # the fit

    def start_fit(self) -> None:
        """Fit in the background under the restrictions; what it finds comes as one step of undo."""
        measurement, options, material = self.measurement, replace(self.options), self.material
        if measurement is None or self.fitting is not None:
            return
        most = 4 if options.lobes == "auto" else int(options.lobes)
        fix, ranges, unknown = self.restrictions.for_fit(material, most)
        if unknown:
            self.say(f"not part of this fit: {', '.join(unknown)}")
        metric, self._keep = self.metric, False

        def run(progress: Progress) -> object:
            from lambent.materials.fitting.fit import fit

            return fit(
                measurement.samples,
                lobes="auto" if options.lobes == "auto" else most,
                method=options.method,
                distribution=options.distribution,
                coupled=material.kd_coupled,
                metric=metric,
                fix=fix,
                ranges=ranges,
                seed=options.seed,
                source=measurement.path,
                progress=progress,
            )

        self.fitting = Work(run, self._take_fit, lambda error: self.say(f"not fitted: {error}"))

    def stop_fit(self, *, keep: bool) -> None:
        """End a fit that runs; `keep`: take the best it has."""
        if self.fitting is not None:
            self._keep = keep
            self.fitting.cancel()

    def _take_fit(self, result: object) -> None:
        from lambent.materials.fitting.fit import FitResult

        assert isinstance(result, FitResult)
        if result.partial and not self._keep:
            self.say("fit cancelled: the material is as it was")
            return
        found = result.material.model_copy(update={"name": self.material.name})
        self.warnings = result.warnings
        self.adopt(found)
        error, flat = result.errors[self.metric], result.lambertian_errors[self.metric]
        self.say(
            f"fitted in {result.seconds:.1f} s: {self.metric} {error:.4g}, {100 * error / flat:.0f} % of Lambertian"
        )

    # from frame to frame

    @property
    def busy(self) -> bool:
        """Whether something goes on that no event announces."""
        works = (self.fitting, self.loading, self.shown.exact_work)
        return self.edits.in_stroke or bool(self._queue) or any(work is not None for work in works)

    def tick(self) -> None:
        """Take what has ended in the background, and bring what is shown up to date."""
        queue, self._queue = self._queue, []
        for act in queue:
            act()
        if self._closed:
            return
        if self.fitting is not None and self.fitting.poll():
            self.fitting = None
        if self.loading is not None and self.loading.poll():
            self.loading = None
        began = time.perf_counter()
        if self.plots_shown:
            self.shown.update(self)
        self.shown.seconds = time.perf_counter() - began

    def close(self) -> None:
        """Stop what goes on in the background; nothing is shown any more."""
        self._closed = True
        for work in (self.fitting, self.loading, self.shown.exact_work):
            if work is not None:
                work.cancel()
