"""When to draw the picture, how large, and with which integrator.

A changed material is drawn over the last picture at full size, on its objects only.

In motion, the few-sample integrator draws fewer pixels if the adapter is too slow. If even half of the width and height
is too slow, planar reflectors lose their mirrored views and show their probes.

`REST_S` after the last change, the same picture is drawn whole, with mirrored views, if no traced picture will replace
it; on a slow adapter with as many pixels as take `LONGEST_REST_S`, because events wait for it. After that, nothing is
drawn.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

REST_S = 0.25
BUDGET_S = 1 / 15  # target time of a frame in motion
LONGEST_REST_S = 1.0  # of a frame at rest; a software adapter on two cores takes 0.5 to 0.7 s for 960x540
SCALES = (1.0, 0.75, 0.5, 0.35, 0.25, 0.18)
PROBE_FRAMES = 8
FIXED_SHARE = 1.5  # a frame in motion may take this multiple of its cost without pixels
LEAP = 2.0  # a larger frame may take this multiple of the target if all of its cost were that of pixels
LEAST_MIRRORED = 0.5  # least scale in motion with mirrored views; below, they are left out
MIRROR_COST = 4.0  # cost of a frame with mirrored views, relative to one without; measured in software: 3 to 4


@dataclass(frozen=True)
class Plan:
    """One picture to draw: its size relative to the window, whether planar reflectors get mirrored views, and whether
    it is drawn over the last one, see `FrameState.over`."""

    scale: float
    mirrors: bool = True
    over: bool = False


WHOLE = Plan(1.0)


class Beat:
    """Schedule of frames, `period_s` apart. A late frame shortens the wait for the next by at most half."""

    def __init__(self, period_s: float) -> None:
        self._period_s, self._due_s = period_s, -math.inf

    def wait_s(self, now_s: float) -> float:
        """Seconds from a frame that starts now to the next one."""
        due_s = max(self._due_s, now_s - self._period_s / 2) + self._period_s
        self._due_s = min(due_s, now_s + self._period_s)
        return self._due_s - now_s


class Resolution:
    """Chooses the size of frames in motion of one kind from the times of earlier frames."""

    def __init__(self, scale: float) -> None:
        self.scale = scale
        self._late = 0  # slow frames at the least size
        self._probe_at = PROBE_FRAMES  # number of slow frames at which another size is tried
        self._times: dict[float, float] = {}  # seconds by scale
        self._fixed_s = self._pixels_s = 0.0  # time of a frame without pixels, and additional time of all pixels

    def seconds(self, scale: float) -> float:
        """Estimated time of a frame."""
        return self._fixed_s + self._pixels_s * scale * scale

    def learn(self, scale: float, seconds: float, budget_s: float) -> None:
        """Learn the time of a frame, and choose the size of the next."""
        before = self._times.get(scale, seconds)
        # A running mean that forgets a stall (shader compilation) at the next frame of this size.
        learnt = min((before + seconds) / 2, 1.2 * seconds)
        # Fewer pixels take no longer: a stall at a size that is not drawn again is no cost without pixels.
        self._times = {s: min(t, learnt) if s < scale else t for s, t in self._times.items()} | {scale: learnt}
        self._fixed_s = min(self._without_pixels_s(), seconds)
        self._pixels_s = (seconds - self._fixed_s) / scale**2
        # Fewer pixels do not reduce the fixed cost.
        budget_s = max(budget_s, FIXED_SHARE * self._fixed_s)
        fits = next((s for s in SCALES if self.seconds(s) <= budget_s), SCALES[-1])
        # Noise can hide the cost of pixels, and one frame of full size then takes seconds.
        leap = scale * math.sqrt(LEAP * budget_s / max(seconds, 1e-9))
        fits_well = next((s for s in SCALES if s <= leap and self.seconds(s) <= 0.7 * budget_s), SCALES[-1])
        if fits < self.scale:
            self.scale = fits
        elif fits_well > self.scale:
            self.scale = fits_well
        elif seconds > budget_s:
            self._late += 1
            if self._late == self._probe_at:  # the learnt cost may come from a stall
                self._probe_at *= 4  # each try is visible, so tries become rarer
                self.scale = SCALES[max(0, SCALES.index(self.scale) - 1)]
                self._times = {scale: time for scale, time in self._times.items() if scale < self.scale}

    def _without_pixels_s(self) -> float:
        """Estimated time of a frame without pixels, from the smallest and the largest drawn so far."""
        small, large = min(self._times), max(self._times)
        if small == large:
            return 0.0
        per_pixel = (self._times[large] - self._times[small]) / (large**2 - small**2)
        return max(0.0, self._times[small] - max(per_pixel, 0.0) * small**2)


class Pacer:
    """Decides what to draw next, from the given time, wanted picture and frame costs."""

    def __init__(self, *, slow_adapter: bool) -> None:
        self._mirrors = not slow_adapter  # whether mirrored views are drawn in motion
        start = 0.5 if slow_adapter else 1.0
        self._sizes = {True: Resolution(start), False: Resolution(start)}  # with mirrored views, and without
        self.shown: object = None  # the picture that the window shows or is about to
        self._changed_s = 0.0
        self._rested = False  # whether the picture was drawn whole
        self._budget_s = BUDGET_S

    @property
    def moving(self) -> Plan:
        """Plan of the next frame in motion."""
        return Plan(self._sizes[self._mirrors].scale, self._mirrors)

    def aim(self, seconds: float) -> None:
        """Set the target time of a frame in motion."""
        self._budget_s = seconds

    def plan(self, picture: object, now_s: float, *, sharpen: bool, adaptive: bool, over: bool = False) -> Plan | None:
        """Plan for `now_s` to show `picture`; None when it is already shown, or not yet due.

        `sharpen`: draw it whole at rest. `over`: in motion, draw the changes over the last picture, at full size.
        """
        if picture != self.shown:
            self.shown, self._changed_s, self._rested = picture, now_s, False
            if over:
                return Plan(1.0, self._mirrors or not adaptive, over=True)
            return self.moving if adaptive else WHOLE
        if self._rested or not sharpen or now_s - self._changed_s < REST_S:
            return None
        size = self._sizes[True]
        return Plan(next((s for s in SCALES if size.seconds(s) <= LONGEST_REST_S), SCALES[-1]))

    def wait_s(self, now_s: float, *, sharpen: bool) -> float | None:
        """Seconds until the next picture is due although nothing changes; None: never."""
        return max(0.0, self._changed_s + REST_S - now_s) if sharpen and not self._rested else None

    def drawn(self, plan: Plan, *, rests: bool = False) -> None:
        """Learn that a frame is shown; `rests`: the one of a picture at rest."""
        self._rested = rests or plan == WHOLE

    def cost(self, plan: Plan, seconds: float, mirrors: int = 0) -> None:
        """Learn the time of a frame in motion with a number of mirrored views, and choose the next."""
        if plan.over:
            return
        size = self._sizes[plan.mirrors]
        size.learn(plan.scale, seconds, self._budget_s)
        if plan.mirrors and mirrors and size.seconds(LEAST_MIRRORED) > self._budget_s:
            self._mirrors = False
        elif not plan.mirrors and plan.scale == 1.0 and MIRROR_COST * seconds <= self._budget_s:
            self._mirrors = True
            self._sizes[True] = Resolution(LEAST_MIRRORED)  # forget earlier times
