"""The material editor without its window: one material, a measurement to compare it with, plots of both.

`lambent edit` shows it beside a preview, the walk mode beside the room. Both draw it with the same panels, and both
change the material through the same `MaterialEdits`, so that undo is shared.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, cast

from lambent.core.progress import Progress
from lambent.materials.fitting.choices import DISTRIBUTION, MAX_LOBES, DistributionChoice, Lobes
from lambent.viewer.background.work import Work, pending
from lambent.viewer.editor.files import Files
from lambent.viewer.editor.measurement import Measurement
from lambent.viewer.editor.shown import Plots, Shown
from lambent.viewer.editor.subject import Subject
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.screen import Screen

LOBES = ("auto", "1", "2", "3", "4", "curve")


class Fit:
    """A fit with `lobes` per side: `work` while it runs, `warnings` of the last one. One fit runs at a time."""

    def __init__(self, subject: Subject, screen: Screen) -> None:
        self._subject, self._screen = subject, screen
        self.lobes = LOBES[1]
        self.distribution: DistributionChoice = DISTRIBUTION
        self.work: Work | None = None
        self.warnings: tuple[str, ...] = ()
        self._keep = False  # whether a stopped fit's result is kept

    def start(self, measurement: Measurement | None, metric: str) -> None:
        """Fit under the restrictions; the result comes as one step of undo."""
        material, say = self._subject.material, self._screen.say
        lobes = cast(Lobes, int(self.lobes) if self.lobes.isdecimal() else self.lobes)
        if measurement is None or self.work is not None:
            return
        most = lobes if isinstance(lobes, int) else MAX_LOBES if lobes == "auto" else 1
        fix, ranges, unknown = self._subject.restrictions.for_fit(material, most)
        if unknown:
            say(f"left out of the fit: {', '.join(unknown)}")
        self._keep, distribution = False, self.distribution

        def run(progress: Progress) -> Any:
            from lambent.materials.fitting.fit import fit  # loads SciPy

            return fit(
                measurement.samples, lobes=lobes, metric=metric, distribution=distribution,
                coupled=material.kd_coupled, fix=fix, ranges=ranges, source=measurement.path, progress=progress,
            )  # fmt: skip

        self.work = Work(run, partial(self._take, metric), lambda error: say(f"not fitted: {error}"))

    def stop(self, *, keep: bool) -> None:
        """Stop a running fit; `keep`: take its best material."""
        if self.work is not None:
            self._keep = keep
            self.work.cancel()

    def poll(self) -> None:
        """Take the result of a finished fit."""
        self.work = pending(self.work)

    def _take(self, metric: str, result: Any) -> None:
        say = self._screen.say
        if result.partial and not self._keep:
            say("fit cancelled: the material is as it was")
            return
        self.warnings = (*result.notes, *result.warnings)
        self._subject.adopt(result.material.model_copy(update={"name": self._subject.material.name}))
        error, flat = result.errors[metric], result.lambertian_errors[metric]
        say(f"fitted in {result.seconds:.1f} s: {metric} {error:.4g}, {100 * error / flat:.0f} % of Lambertian")


class Editor:
    """Editor of the material `name` of `edits`; see the module."""

    def __init__(self, edits: MaterialEdits, name: str, screen: Screen) -> None:
        self.subject = Subject(edits, name)
        self.fit = Fit(self.subject, screen)
        self.files = Files(self.subject, screen, self.show_measurement)
        self.plots, self.shown = Plots(), Shown(None)
        self.measurement: Measurement | None = None
        self.metric = "cuberoot"
        self.linked_roughness = True
        self.leave: Callable[[], None] | None = None  # closes the editor within another mode
        self._queue: list[Callable[[], None]] = []
        self._closed = False
        self.files.adopted = partial(self.queue, self._fit_axes)  # after the frame, when the curves are up to date

    def _fit_axes(self) -> None:
        self.plots.fit_axes = True

    def show_measurement(self, measurement: Measurement | None) -> None:
        """Compare with this measurement from now on."""
        self.measurement, self.fit.warnings = measurement, ()
        self.shown = Shown(measurement)
        distances = [abs(incident.theta_deg - 45) for incident in self.shown.incidents]
        self.plots.choose(distances.index(min(distances)))

    def save(self) -> None:
        """Write the material to its file."""
        self.files.save(self.measurement)

    def queue(self, act: Callable[[], None]) -> None:
        """Run an action after the frame: a panel must not change a list while it draws it."""
        self._queue.append(act)

    @property
    def busy(self) -> bool:
        """Whether background work runs that ends without an event."""
        return self.subject.edits.in_stroke or bool(self._queue or self._works)

    @property
    def _works(self) -> list[Work]:
        return [work for work in (self.fit.work, self.files.loading, self.shown.exact_work) if work is not None]

    def tick(self) -> None:
        """Take results of work in the background, and bring the plots up to date."""
        queue, self._queue = self._queue, []
        for act in queue:
            act()
        if self._closed:
            return
        self.fit.poll()
        self.files.poll()
        if self.plots.visible:
            self.shown.update(self.subject, self.metric, self.plots)

    def close(self) -> None:
        """Stop background work."""
        self._closed = True
        for work in self._works:
            work.cancel()
