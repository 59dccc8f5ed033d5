"""The background bake of a view for relighting: the process, its progress, and its remaining time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from lambent.baking.interreflection.proposal import time_said
from lambent.baking.running.relit import Relit
from lambent.store.contract import VIEW
from lambent.viewer.background.worker_process import WorkerProcess
from lambent.viewer.modes.edit.baking import LEAST_DONE, RELIGHT, WORKER


class ViewBake(WorkerProcess):
    """One run of the worker; `line` is its present step and the remaining time."""

    def __init__(self, relit: Relit, wake: Callable[[], None]) -> None:
        self.line, self._what, self._began_s = "this view is being baked for relighting", "", 0.0
        super().__init__(
            WORKER, [str(relit.folder), RELIGHT], "the bake", lambda said, _: self._report(said), ends=True, wake=wake
        )
        self.ask([relit.room.model_dump(mode="json"), relit.view.meta[VIEW]])

    def _report(self, said: Mapping[str, Any]) -> None:
        now_s, done = time.monotonic(), said["done"] / max(said["total"], 1e-9)
        if said["what"] != self._what:
            self._what, self._began_s = said["what"], now_s
        left = f", about {time_said((now_s - self._began_s) * (1 / done - 1))}" if LEAST_DONE <= done < 1 else ""
        self.line = f"this view is being baked for relighting: {self._what} {100 * done:.0f} %{left}"
