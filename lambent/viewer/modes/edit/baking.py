"""Background bakes and measurements of the edit mode: the process, its progress, and its remaining time."""

from __future__ import annotations

import json
import re
import tempfile
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from lambent.baking.interreflection.proposal import Proposal, time_said
from lambent.baking.interreflection.settings import Bounces
from lambent.editing.interreflection.noise import PASS
from lambent.editing.session.document import SessionDocument
from lambent.editing.session.session import Session
from lambent.viewer.background.worker_process import WorkerProcess

LIGHTS = (400, 4000)
WORKER, BOUNCES, RELIGHT = "lambent.viewer.modes.edit.worker", "--bounces", "--relight"
ONE_CURVE, TWO_CURVES = 0.6, 12.0  # time of transport for a whole view, relative to the time of visibility
LEAST_DONE = 0.02  # least share done before the remaining time is estimated
_NUMBER = re.compile(r"(\d+) lights$")


@dataclass
class Stage:
    """Progress of the transport for `lights` lights: its steps, by name, with weights relative to visibility."""

    weights: Mapping[str, float]
    began_s: float
    lights: int = 0
    step: str = ""
    before: float = 0.0  # weight of the steps before
    share: float = 0.0  # of the step
    reported_s: float = 0.0

    def take(self, what: str, share: float, lights: int, now_s: float) -> None:
        """Take the progress of a step."""
        if lights != self.lights:
            self.lights, self.step, self.before, self.began_s = lights, what, 0.0, now_s
        elif what != self.step:
            self.before, self.step = self.before + self._weight(self.step), what
        self.share, self.reported_s = share, now_s

    def left_s(self, now_s: float) -> float | None:
        """Estimated seconds until these lights are done; None until there is enough progress for an estimate."""
        total = 1.0 + sum(self.weights.values())
        done = (self.before + self.share * self._weight(self.step)) / total
        if done < LEAST_DONE:
            return None
        left_s = (self.reported_s - self.began_s) * (1 - done) / done
        return max(left_s - (now_s - self.reported_s), 1.0)

    def _weight(self, step: str) -> float:
        return self.weights.get(_NUMBER.sub("", step).rstrip(", "), 1.0)


@dataclass
class Passes:
    """Progress of interreflections: passes double the samples up to `wanted`."""

    wanted: int
    samples: int = 0  # samples of the present pass
    share: float = 0.0
    reported_s: float = 0.0
    begins: tuple[tuple[float, float], ...] = ()  # time and share at the begin of the last two passes

    def take(self, before: int, samples: int, share: float, now_s: float) -> None:
        """Take the progress of the pass from `before` to `samples` samples."""
        self.share, self.reported_s = (before + share * (samples - before)) / self.wanted, now_s
        if samples != self.samples and share < 1:  # finished passes end at once
            self.samples, self.begins = samples, (*self.begins[-1:], (now_s, self.share))

    def left_s(self, now_s: float) -> float | None:
        """Estimated seconds until all passes are done, from the last passes; None while there is no estimate."""
        began_s, before = self.begins[0] if self.begins else (0.0, 1.0)
        if self.share - before < LEAST_DONE * (1 - before):
            return None
        pace = (self.share - before) / max(self.reported_s - began_s, 1e-9)
        return max((1 - self.share) / max(pace, 1e-9) - (now_s - self.reported_s), 1.0)


class Baking:
    """One run of the worker: transport for a number of lights, interreflections, or a proposal for interreflections.

    Attributes
    ----------
    document : SessionDocument
        The session to bake for.
    error : str
        Reason of a failure, in one line; else empty.
    arrived : list of int
        Numbers of lights that have arrived in the store, in order; the reader removes them.
    has_view : bool
        Whether the points of the view are in the store.
    samples : int
        Present samples of interreflections at all points.
    proposal : Proposal or None
        The requested proposal, once it is finished.
    """

    def __init__(
        self,
        session: Session,
        store: Path,
        lights: Sequence[int] = LIGHTS,
        bounces: Bounces | None = None,
        proposing: Collection[str] | None = None,
    ) -> None:
        self.document: SessionDocument = session.document
        self.store, self.error, self.what = store, "", "starting"
        self.arrived: list[int] = []
        self.has_view = False
        self._share = 0.0
        self.samples = 0
        self.proposal: Proposal | None = None
        self._passes = Passes(bounces.samples) if bounces is not None else None
        words = list(map(str, lights))
        if bounces is not None:
            kept = [] if proposing is None else [json.dumps(sorted(proposing))]
            words = [BOUNCES, json.dumps(bounces.said()), *kept]
        terms = [(name, t) for name in self.document.materials for t in session.original(name).terms]
        self._curves = {(name, t.name): len(t.factors) for name, t in terms}
        self._stage = Stage({}, time.monotonic())
        self.weigh({name: 1 / len(self.document.materials) for name in self.document.materials})
        self._job = tempfile.TemporaryDirectory()  # kept while the process runs
        job = Path(self._job.name) / "job.edits.json"
        Session(session.document, session.folder).save(job)
        self._process: WorkerProcess | None = WorkerProcess(
            WORKER, [str(job), str(store), *words], "the bake", lambda said, _: self.take(said), ends=True
        )

    @property
    def running(self) -> bool:
        """Whether the worker runs; handles its end."""
        if self._process is None or self._process.running:
            return self._process is not None
        self.error, self._process = self._process.error, None
        self._job.cleanup()
        return False

    @property
    def line(self) -> str:
        """The present step and the remaining time, as a line."""
        left_s, stage = self._stage.left_s(time.monotonic()), self._stage
        if self._passes is not None:
            left_s, step = self._passes.left_s(time.monotonic()), f"{self.what} {100 * self._share:.0f} %"
            return step if left_s is None else f"{step}, about {time_said(left_s)} for {self._passes.wanted}"
        step = f"{self.what} {100 * stage.share:.0f} %"
        return step if left_s is None else f"{step}, about {left_s:.0f} s for {stage.lights} lights"

    def weigh(self, shares: Mapping[str, float]) -> None:
        """Set each material's share of the view's points."""
        self._stage.weights = {
            f"{name}: {term}": shares.get(name, 0.0) * (TWO_CURVES if curves == 2 else ONE_CURVE)
            for (name, term), curves in self._curves.items()
        }

    def close(self) -> None:
        """Stop the process; finished work stays in the store."""
        if self._process is not None:
            self._process.close()
            self._process = None
            self._job.cleanup()

    def take(self, said: Mapping[str, object]) -> None:
        """Handle a line of the worker."""
        if "proposal" in said:
            self.proposal = Proposal.of(cast(Mapping[str, Any], said["proposal"]))
            return
        if "samples" in said:
            self.samples = int(str(said["samples"]))
            return
        if "lights" in said:
            self.arrived.append(int(str(said["lights"])))
            return
        self.what = str(said["what"])
        self._share = float(str(said["done"])) / max(float(str(said["total"])), 1e-9)
        found = _NUMBER.search(self.what)
        if found:
            self.has_view = True
            self._stage.take(self.what, self._share, int(found[1]), time.monotonic())
        found = PASS.search(self.what)
        if found and self._passes is not None:
            self._passes.take(self.samples, int(found[1]), self._share, time.monotonic())
