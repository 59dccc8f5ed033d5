"""When to draw the picture, how large, and with which integrator.

While anything the picture shows changes: the few-sample integrator, on fewer pixels where the adapter is too slow for
them. `REST_S` after the last change: every frame adds samples of `qmc` to the picture, up to a stated count; then
nothing is drawn any more.
"""

from __future__ import annotations

from dataclasses import dataclass

REST_S = 0.25
BUDGET_S = 1 / 15  # a frame in motion should take no longer
SCALES = (1.0, 0.75, 0.5, 0.35, 0.25, 0.18)
PROBE_FRAMES = 8
FIXED_SHARE = 1.5  # a frame in motion may take so many times what it takes without pixels


@dataclass(frozen=True)
class Plan:
    """One picture to draw: its size relative to the window, and its index in the accumulation (None: few samples)."""

    scale: float
    accumulate: int | None


class Pacer:
    """Tells what to draw next. Everything it knows it is told: the time, what changed, what a frame cost."""

    def __init__(self, *, accumulate_to: int, slow_adapter: bool) -> None:
        self.accumulate_to = accumulate_to
        self.moving_scale = 0.5 if slow_adapter else 1.0
        self._shown: object = None
        self._changed_s = 0.0
        self._accumulated = 0
        self._last: Plan | None = None
        self._budget_s = BUDGET_S
        self._late = 0  # frames that took too long although no fewer pixels can be drawn
        self._times: dict[float, float] = {}  # seconds of frames in motion, by their scale

    @property
    def shown(self) -> object:
        """The picture that the window shows or is about to."""
        return self._shown

    @property
    def accumulated(self) -> int:
        return self._accumulated

    def aim(self, seconds: float) -> None:
        """A frame in motion should take no longer from now on."""
        self._budget_s = seconds

    def plan(self, picture: object, now_s: float, *, refine: bool, adaptive: bool) -> Plan | None:
        """What to draw at `now_s` so that the window shows `picture`; None when it is shown already, or not yet due."""
        if picture != self._shown:
            self._shown, self._changed_s, self._accumulated = picture, now_s, 0
            return Plan(self.moving_scale if adaptive else 1.0, None)
        return self._next(refine) if now_s - self._changed_s >= REST_S else None

    def wait_s(self, now_s: float, *, refine: bool) -> float | None:
        """Seconds until the next picture is due although nothing changes; None: never."""
        return None if self._next(refine) is None else max(0.0, self._changed_s + REST_S - now_s)

    def _next(self, refine: bool) -> Plan | None:
        """What a resting camera still lacks."""
        if refine:
            return Plan(1.0, self._accumulated) if self._accumulated < self.accumulate_to else None
        return None if self._last == Plan(1.0, None) else Plan(1.0, None)

    def drawn(self, plan: Plan) -> None:
        self._last = plan
        self._accumulated = 0 if plan.accumulate is None else plan.accumulate + 1

    def cost(self, plan: Plan, seconds: float) -> None:
        """Learn what a frame in motion took, and choose the size of the next."""
        if plan.accumulate is not None:
            return
        before = self._times.get(plan.scale, seconds)
        # A mean, but one that forgets a stall (a shader being compiled) at the next frame of this size.
        self._times[plan.scale] = min((before + seconds) / 2, 1.2 * seconds)
        fixed_s = min(self._fixed_s(), seconds)
        # Fewer pixels do not buy what costs the same with any number of them.
        budget_s = max(self._budget_s, FIXED_SHARE * fixed_s)
        pixels_s = (seconds - fixed_s) / plan.scale**2
        fits = next((s for s in SCALES if fixed_s + pixels_s * s * s <= budget_s), SCALES[-1])
        fits_well = next((s for s in SCALES if fixed_s + pixels_s * s * s <= 0.7 * budget_s), SCALES[-1])
        if fits < self.moving_scale:
            self.moving_scale = fits
        elif fits_well > self.moving_scale:
            self.moving_scale = fits_well
        elif seconds > budget_s:
            self._late += 1
            if self._late % PROBE_FRAMES == 0:  # what more pixels cost may have been learnt from a stall
                self.moving_scale = SCALES[max(0, SCALES.index(self.moving_scale) - 1)]
                self._times = {scale: time for scale, time in self._times.items() if scale < self.moving_scale}

    def _fixed_s(self) -> float:
        """What a frame of no pixels would take, by the least and the most pixels drawn so far."""
        small, large = min(self._times), max(self._times)
        if small == large:
            return 0.0
        per_pixel = (self._times[large] - self._times[small]) / (large**2 - small**2)
        return max(0.0, self._times[small] - max(per_pixel, 0.0) * small**2)
