"""The background bake of a view for relighting: the process, its progress, and its remaining time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from lambent.bake.interreflection.proposal import time_said
from lambent.bake.running.relit import Relit
from lambent.viewer.background.worker_process import WorkerProcess

WORKER = "lambent.viewer.modes.relight.worker"
LEAST_DONE = 0.02  # least share done before the remaining time is estimated


class ViewBake:
    """One run of the worker; `wake` is called as it goes on."""

    def __init__(self, relit: Relit, wake: Callable[[], None]) -> None:
        self._what, self._share, self._began_s = "starting", 0.0, time.monotonic()
        self._process = WorkerProcess(
            WORKER, [str(relit.folder)], "the bake", lambda said, _: self._take(said), ends=True, wake=wake
        )
        self._process.ask({"room": relit.room.model_dump(mode="json"), **relit.view.meta})
        self.close = self._process.close

    @property
    def running(self) -> bool:
        """Whether the worker runs; handles its end."""
        return self._process.running

    @property
    def error(self) -> str:
        """Reason of a failure, in one line; else empty."""
        return self._process.error

    @property
    def line(self) -> str:
        """The present step and the remaining time."""
        said = f"this view is being baked for relighting: {self._what} {100 * self._share:.0f} %"
        if not LEAST_DONE <= self._share < 1:
            return said
        return f"{said}, about {time_said((time.monotonic() - self._began_s) * (1 / self._share - 1))}"

    def _take(self, said: Mapping[str, Any]) -> None:
        if said["what"] != self._what:
            self._what, self._began_s = said["what"], time.monotonic()
        self._share = float(said["done"]) / max(float(said["total"]), 1e-9)
