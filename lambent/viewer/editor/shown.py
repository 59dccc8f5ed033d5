"""What the editor shows at this moment, brought up to date piece by piece where something has changed."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.materials.document import Material
from lambent.materials.fitting.disks import in_plane_tuples
from lambent.viewer.editor.readings import (
    FINE_PX,
    Disks,
    Floats,
    Incident,
    Picture,
    albedo,
    in_plane,
    incidents_of,
    white_of,
)
from lambent.viewer.editor.work import Work

if TYPE_CHECKING:
    from lambent.viewer.editor.editor import Editor

COARSE_PX = 40  # of a disk while a slider moves
MOVING_VALUES = 30_000  # pixels of disks while a slider moves; with many disks they are smaller still
LEAST_PX = 12
REST_S = 0.3
ALBEDO_SAMPLES, MOVING_ALBEDO_SAMPLES = 1024, 128


class Shown:
    """Disks, curves, albedo and errors of the material A and, where there is one, of B.

    Attributes
    ----------
    error, exact : float or None, bool
        Of A under the chosen metric, and whether over all tuples.
    compared_error : float or None
        Of B.
    images : dict of str to (H, W, 4) uint8
        "measured", "A" and "B": pictures of all disks; a new array where one has changed.
    layout : dict of str to Disks
        How each of them is laid out.
    measured_curve : dict of bool to (theta_o, p)
        Per side (far), of the chosen incident direction.
    curves : dict of (name, far) to p (359, 3)
    measured_albedo, albedos : as the curves, over theta_i
    seconds : float
        What the last update took.
    """

    def __init__(self) -> None:
        self.error: float | None = None
        self.exact = False
        self.exact_errors: dict[str, float] = {}
        self.compared_error: float | None = None
        self.images: dict[str, Picture] = {}
        self.layout: dict[str, Disks] = {}
        self.incidents: tuple[Incident, ...] = ()
        self.transmits = False
        self.measured_curve: dict[bool, tuple[Floats, Floats]] = {}
        self.curves: dict[tuple[str, bool], Floats] = {}
        self.measured_albedo: dict[bool, tuple[Floats, Floats]] = {}
        self.albedos: dict[tuple[str, bool], Floats] = {}
        self.seconds = 0.0
        self.moving_seconds = 0.0  # of the last update while a slider moved
        self.exact_work: Work | None = None
        self._white = 1.0
        self._done: dict[str, Any] = {}  # part -> what it was last made of
        self._disks: dict[tuple[Any, ...], Disks] = {}
        self._exact_of: Material | None = None
        self._changed_s = 0.0

    def update(self, editor: Editor) -> None:
        """Show the editor's materials as they are now."""
        began = time.perf_counter()
        moving = self._moving(editor)
        a, b, measurement = editor.material, editor.compared, editor.measurement
        gathered = measurement.gathered if measurement else ()
        if self._new("incidents", measurement):
            self.incidents = incidents_of(gathered)
        self.transmits = (
            bool(measurement and measurement.samples.info.transmits) or a.transmits or bool(b and b.transmits)
        )
        editor.chosen = min(editor.chosen, len(self.incidents) - 1)
        self._update_measured(editor)
        for name, material in (("A", a), ("B", b)):
            self._update_material(name, material, editor.chosen, moving)
        self._update_error(editor, moving)
        if moving:
            self.moving_seconds = time.perf_counter() - began

    def _moving(self, editor: Editor) -> bool:
        """Whether a slider moves: one that is held still counts as at rest after a moment."""
        now_s = time.monotonic()
        if self._new("moment", editor.material):
            self._changed_s = now_s
        return editor.edits.in_stroke and now_s - self._changed_s < REST_S

    def _new(self, part: str, *made_of: Any) -> bool:
        """Whether `part` was last made of something else; it counts as made of this from now on."""
        if self._done.get(part) == made_of:
            return False
        self._done[part] = made_of
        return True

    def _update_measured(self, editor: Editor) -> None:
        measurement = editor.measurement
        if measurement is None:
            return
        if self._new("measured disks", measurement, self.transmits):
            disks = self._laid_out(FINE_PX)
            values = measurement.disks
            if len(values) < len(disks.tiles):  # the model transmits, the table does not
                values = np.concatenate([values, np.full_like(values, np.nan)])
            self._white = white_of(values)
            self.images["measured"], self.layout["measured"] = disks.picture(values, self._white), disks
        if measurement.gathered and self._new("measured curve", measurement, editor.chosen):
            entry = measurement.gathered[editor.chosen]
            self.measured_curve = {far: in_plane_tuples(entry, far) for far in (False, True)}
            near = [e for e in measurement.gathered if e.phi_deg == entry.phi_deg]
            theta = np.array([e.theta_deg for e in near])
            self.measured_albedo = {
                far: (theta, np.stack([np.broadcast_to(e.albedo(far), 3) for e in near])) for far in (False, True)
            }

    def _update_material(self, name: str, material: Material | None, chosen: int, moving: bool) -> None:
        if material is None:
            for parts in (self.images, self.layout):
                parts.pop(name, None)
            for far in (False, True):
                self.curves.pop((name, far), None)
                self.albedos.pop((name, far), None)
            self._done = {part: made for part, made in self._done.items() if not part.endswith(f" {name}")}
            return
        scatters = material.model_copy(update={"name": "", "provenance": None})
        pixels = self._moving_px() if moving else FINE_PX
        incident = self.incidents[chosen]
        changed = self._new(f"disks {name}", scatters, self.incidents, self.transmits)
        if changed or (not moving and self.layout[name].pixels != FINE_PX):
            disks = self._laid_out(pixels)
            values = disks.model(material)
            if "measured" not in self.images and name == "A":
                self._white = white_of(values)
            self.images[name], self.layout[name] = disks.picture(values, self._white), disks
        if self._new(f"curves {name}", scatters, incident):
            for far in (False, True):
                self.curves[name, far] = in_plane(material, incident, far)
        if self._new(f"albedo {name}", scatters, incident.phi_deg, moving):
            samples = MOVING_ALBEDO_SAMPLES if moving else ALBEDO_SAMPLES
            near, far_side = albedo(material, incident.phi_deg, samples)
            self.albedos[name, False], self.albedos[name, True] = near, far_side

    def _laid_out(self, pixels: int) -> Disks:
        key = (self.incidents, self.transmits, pixels)
        if key not in self._disks:
            self._disks = {k: v for k, v in self._disks.items() if k[:2] == key[:2]}
            self._disks[key] = Disks(self.incidents, self.transmits, pixels)
        return self._disks[key]

    def _moving_px(self) -> int:
        count = len(self.incidents) * (2 if self.transmits else 1)
        return int(np.clip(np.sqrt(MOVING_VALUES / count / (np.pi / 4)), LEAST_PX, COARSE_PX))

    def _update_error(self, editor: Editor, moving: bool) -> None:
        measurement, material = editor.measurement, editor.material
        if self.exact_work is not None and self.exact_work.poll():
            self.exact_work = None
        if measurement is None:
            self.error = self.compared_error = None
            return
        b = editor.compared
        if self._new("error B", b, editor.metric):
            self.compared_error = None if b is None else measurement.error(b, editor.metric)
        if measurement.is_small and not moving and self._exact_of != material:
            self._exact_of, self.exact_errors = material, measurement.exact_errors(material)
        if self._exact_of == material:
            self.error, self.exact = self.exact_errors[editor.metric], True
            return
        if self._new("error", material, editor.metric):
            self.error, self.exact = measurement.error(material, editor.metric), False
        if moving and self.exact_work is not None:
            self.exact_work.cancel()
        if not moving and self.exact_work is None:

            def take(errors: dict[str, float]) -> None:
                self._exact_of, self.exact_errors = material, errors

            self.exact_work = Work(lambda progress: measurement.exact_errors(material, progress), take)
