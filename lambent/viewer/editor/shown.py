"""The present plots of the editor, updated only if an input has changed."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.document import Material
from lambent.materials.fitting.shown.incidence import in_plane_tuples
from lambent.viewer.background.work import Work, pending
from lambent.viewer.editor import readings
from lambent.viewer.editor.measurement import Measurement
from lambent.viewer.editor.readings import FINE_PX, Disks, incidents_of, white_of
from lambent.viewer.editor.subject import Subject
from lambent.viewer.mode import Image

COARSE_PX = 40  # diameter of a disk while a slider moves
MOVING_VALUES = 30_000  # total pixels of all disks while a slider moves
LEAST_PX = 12
REST_S = 0.3
ALBEDO_SAMPLES, MOVING_ALBEDO_SAMPLES = 1024, 128

Curves = dict[tuple[str, bool], tuple[Floats, Floats]]  # by ("measured", "A" or "B", far)
Channel = Literal["mean", "RGB", "red", "green", "blue"]
Scale = Literal["cube root", "log", "linear"]
CHANNELS: tuple[Channel, ...] = get_args(Channel)
SCALES: tuple[Scale, ...] = get_args(Scale)


@dataclass
class Plots:
    """How the material is plotted. `chosen` is the index of the incident direction whose plane is shown."""

    chosen: int = 0
    channel: Channel = "mean"
    scale: Scale = "cube root"
    brighter: float = 0.0  # stops on p in the disks
    visible: bool = True
    fit_axes: bool = True  # the axes are fitted to the curves in the next frame

    def choose(self, incident: int) -> None:
        """Plot the plane of another incident direction."""
        self.chosen, self.fit_axes = incident, True


class Shown:
    """Disks, curves, albedo and errors of the material A, of B if there is one, and of a measurement."""

    def __init__(self, measurement: Measurement | None) -> None:
        self._measurement = measurement
        self.incidents = incidents_of(measurement.gathered if measurement else ())
        self.error: float | None = None  # of A under the chosen metric
        self.exact = False  # whether the error is over all tuples
        self.exact_errors: dict[str, float] = {}
        self.compared_error: float | None = None  # of B
        self.images: dict[str, Image] = {}  # "measured", "A" and "B": all disks in one picture
        self.layout: dict[str, Disks] = {}
        self.transmits = False
        self.curves: Curves = {}  # p (N, C) over theta_o (N,) in degrees, in the chosen plane of incidence
        self.albedos: Curves = {}  # (N, C) over theta_i
        self.moving_seconds = 0.0  # time of the last update while a slider moved
        self.exact_work: Work | None = None
        self._white = 1.0
        self._done: dict[str, Any] = {}  # part -> the inputs it was last made from
        self._values: dict[str, Floats] = {}  # of the disks of A and B
        self._disks: dict[tuple[bool, int], Disks] = {}
        self._exact_of: Material | None = None
        self._changed_s = 0.0

    def update(self, subject: Subject, metric: str, plots: Plots) -> None:
        """Show the materials A and B as they are now."""
        began, measurement = time.perf_counter(), self._measurement
        a, b = subject.material, subject.compared
        moving = self._moving(a, subject.edits.in_stroke)
        measured = measurement is not None and measurement.samples.info.transmits
        self.transmits = measured or a.transmits or bool(b and b.transmits)
        if measurement is not None:
            self._update_measured(measurement, plots)
        for name, material in (("A", a), ("B", b)):
            self._update_material(name, material, plots, moving)
        self.exact_work = pending(self.exact_work)
        if measurement is not None:
            self._update_error(measurement, a, b, metric, moving)
        if moving:
            self.moving_seconds = time.perf_counter() - began

    def _moving(self, material: Material, in_stroke: bool) -> bool:
        """Whether a slider moves; a slider held still counts as at rest after a moment."""
        now_s = time.monotonic()
        if self._new("moment", material):
            self._changed_s = now_s
        return in_stroke and now_s - self._changed_s < REST_S

    def _new(self, part: str, *made_of: Any) -> bool:
        """Whether the inputs of `part` have changed; records the present inputs."""
        if self._done.get(part) == made_of:
            return False
        self._done[part] = made_of
        return True

    def _update_measured(self, measurement: Measurement, plots: Plots) -> None:
        chosen = plots.chosen
        if self._new("measured disks", self.transmits, plots.brighter):
            disks = self._laid_out(FINE_PX)
            values, guessed = measurement.disks, measurement.mirrored
            if len(values) < len(disks.tiles):  # the model transmits, the table does not
                beyond = np.full_like(values, np.nan)
                values, guessed = np.concatenate([values, beyond]), np.concatenate([guessed, beyond])
            self._white = white_of(values)
            white = self._white * 2 ** (-plots.brighter / 3)  # a disk shows the cube root
            self.images["measured"], self.layout["measured"] = disks.picture(values, white, guessed), disks
        if measurement.gathered and self._new("measured curve", chosen):
            entry = measurement.gathered[chosen]
            near = [e for e in measurement.gathered if e.phi_deg == entry.phi_deg]
            theta = np.array([e.theta_deg for e in near])
            for far in (False, True):
                self.curves["measured", far] = in_plane_tuples(entry, far)
                albedos = np.stack([np.broadcast_to(e.albedo(far), 3) for e in near])
                self.albedos["measured", far] = (theta, albedos)

    def _update_material(self, name: str, material: Material | None, plots: Plots, moving: bool) -> None:
        if material is None:
            for part in (self.images, self.layout, self._values):
                part.pop(name, None)
            for curves in (self.curves, self.albedos):
                curves.pop((name, False), None)
                curves.pop((name, True), None)
            self._done = {part: made for part, made in self._done.items() if not part.endswith(f" {name}")}
            return
        scatters = material.model_copy(update={"name": "", "provenance": None})
        pixels = self._moving_px() if moving else FINE_PX
        incident = self.incidents[plots.chosen]
        changed = self._new(f"disks {name}", scatters, self.transmits)
        if changed or (not moving and self.layout[name].pixels != FINE_PX):
            disks = self._laid_out(pixels)
            self._values[name], self.layout[name] = disks.model(material), disks
            if "measured" not in self.images and name == "A":
                self._white = white_of(self._values[name])
            changed = True
        if self._new(f"brightness {name}", self._white, plots.brighter) or changed:
            white = self._white * 2 ** (-plots.brighter / 3)
            self.images[name] = self.layout[name].picture(self._values[name], white)
        if self._new(f"curves {name}", scatters, incident):
            for far in (False, True):
                self.curves[name, far] = readings.THETA_O_DEG, readings.in_plane(material, incident, far)
        if self._new(f"albedo {name}", scatters, incident.phi_deg, moving):
            samples = MOVING_ALBEDO_SAMPLES if moving else ALBEDO_SAMPLES
            for far, values in zip((False, True), readings.albedo(material, incident.phi_deg, samples), strict=True):
                self.albedos[name, far] = readings.ALBEDO_THETA_DEG, values

    def _laid_out(self, pixels: int) -> Disks:
        key = (self.transmits, pixels)
        if key not in self._disks:
            self._disks = {k: v for k, v in self._disks.items() if k[0] == self.transmits}
            self._disks[key] = Disks(self.incidents, *key)
        return self._disks[key]

    def _moving_px(self) -> int:
        count = len(self.incidents) * (2 if self.transmits else 1)
        return int(np.clip(np.sqrt(MOVING_VALUES / count / (np.pi / 4)), LEAST_PX, COARSE_PX))

    def _update_error(self, measured: Measurement, a: Material, b: Material | None, metric: str, moving: bool) -> None:
        if self._new("error B", b, metric):
            self.compared_error = None if b is None else measured.error(b, metric)
        if measured.is_small and not moving and self._exact_of != a:
            self._exact_of, self.exact_errors = a, measured.exact_errors(a)
        if self._exact_of == a:
            self.error, self.exact = self.exact_errors[metric], True
            return
        if self._new("error", a, metric):
            self.error, self.exact = measured.error(a, metric), False
        if moving and self.exact_work is not None:
            self.exact_work.cancel()
        if not moving and self.exact_work is None:

            def take(errors: dict[str, float]) -> None:
                self._exact_of, self.exact_errors = a, errors

            self.exact_work = Work(lambda progress: measured.exact_errors(a, progress), take)
