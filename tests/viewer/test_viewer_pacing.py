"""What the window draws when: quick in motion, better at rest, then nothing."""

import itertools

import numpy as np
import pytest

from lambent.viewer.pacing import BUDGET_S, LONGEST_REST_S, REST_S, SCALES, WHOLE, Beat, Pacer, Plan


def pacer(**options):
    return Pacer(**{"slow_adapter": False, **options})


def step(pacer, picture, now_s, sharpen=True, adaptive=True):
    rests = picture == pacer.shown
    plan = pacer.plan(picture, now_s, sharpen=sharpen, adaptive=adaptive)
    if plan:
        pacer.drawn(plan, rests=rests)
    return plan


def test_motion_then_idle():
    p = pacer()
    assert step(p, "a", 0.0) == WHOLE
    assert step(p, "a", 1.0) is None
    assert p.wait_s(1.0, sharpen=True) is None
    assert step(p, "b", 1.01) == WHOLE


def test_a_slow_adapter_sharpens_once_at_rest():
    p = pacer(slow_adapter=True)
    assert step(p, "a", 0.0) == Plan(0.5, mirrors=False)
    assert step(p, "a", 0.1) is None
    assert p.wait_s(0.1, sharpen=True) == pytest.approx(REST_S - 0.1)
    assert [step(p, "a", 1.0 + k) for k in range(3)] == [WHOLE, None, None]
    assert p.wait_s(2.0, sharpen=True) is None
    assert step(p, "b", 2.0) == Plan(0.5, mirrors=False)


def test_nothing_is_sharpened_that_a_traced_picture_replaces():
    p = pacer(slow_adapter=True)
    step(p, "a", 0.0, sharpen=False)
    assert step(p, "a", 9.0, sharpen=False) is None and p.wait_s(9.0, sharpen=False) is None
    assert step(p, "a", 9.0) == WHOLE, "tracing has failed"


def test_events_wait_no_longer_for_a_frame_at_rest():
    p = pacer(slow_adapter=True)
    p.cost(WHOLE, 3 * LONGEST_REST_S)
    step(p, "a", 0.0)
    plan = step(p, "a", 1.0)
    assert plan.mirrors and plan.scale == 0.5, "the largest size that takes less"


def test_what_is_drawn_over_a_picture_is_drawn_whole_at_rest():
    p = pacer()
    step(p, "a", 0.0)
    plan = p.plan("b", 1.0, sharpen=True, adaptive=True, over=True)
    p.drawn(plan)
    assert plan == Plan(1.0, over=True) and step(p, "b", 2.0) == WHOLE


def walk(p, with_mirrors_s, without_s, frames):
    """Frames in motion that take so long at full size; returns the plans."""
    plans = []
    for _ in range(frames):
        plans.append(plan := p.moving)
        p.cost(plan, (with_mirrors_s if plan.mirrors else without_s) * plan.scale**2, int(plan.mirrors))
    return plans


def test_mirrored_views_are_left_out_where_half_the_size_is_too_slow_with_them():
    p = pacer()
    plans = walk(p, 6 * BUDGET_S, 1.5 * BUDGET_S, 30)
    assert plans[0].mirrors and not plans[1].mirrors
    assert {plan.mirrors for plan in plans[1:]} == {False} and plans[-1].scale == 0.75
    p = pacer()
    assert all(plan.mirrors for plan in walk(p, 2 * BUDGET_S, 0.5 * BUDGET_S, 30)), "half the size is enough"


def test_mirrored_views_come_back_when_there_is_time_for_them():
    p = pacer()
    p.cost(p.moving, 50 * BUDGET_S, 1)  # a shader being compiled
    plans = walk(p, 0.3 * BUDGET_S, 0.1 * BUDGET_S, 10)
    assert not plans[0].mirrors and plans[-1] == Plan(1.0)
    assert step(p, "a", 0.0) == plans[-1], "what is at rest has them in any case"


def test_a_scene_without_reflectors_keeps_what_it_has():
    p = pacer()
    p.cost(Plan(1.0), 10 * BUDGET_S, mirrors=0)
    assert p.moving.mirrors


@pytest.mark.parametrize(("share", "mirrors"), [(0.2, True), (0.5, False)])
def test_mirrors_come_back_where_four_frames_fit_one(share, mirrors):
    """A frame with mirrored views costs four without; of a frame that takes half the budget, they are left out."""
    p = pacer(slow_adapter=True)
    for _ in range(6):
        p.cost(Plan(1.0, mirrors=False), share * BUDGET_S)
    assert p.moving.mirrors is mirrors


def test_full_resolution_on_request():
    assert step(pacer(slow_adapter=True), "a", 0.0, adaptive=False) == Plan(1.0)


def test_the_size_in_motion_meets_the_budget():
    p = pacer()
    p.cost(Plan(1.0), 10 * BUDGET_S)
    assert p.moving.scale == 0.25
    p.cost(Plan(0.25), BUDGET_S / 8)
    assert p.moving.scale == 0.5  # larger only when it fits with room to spare
    p.cost(Plan(0.5), BUDGET_S * 0.9)
    assert p.moving.scale == 0.5
    p.cost(Plan(0.5), BUDGET_S / 100)
    assert p.moving.scale == 1.0
    p.cost(Plan(1.0), 1e3)
    assert p.moving.scale == SCALES[-1]


def test_a_shorter_frame_time_takes_fewer_pixels():
    p = pacer()
    p.aim(0.1)
    p.cost(Plan(1.0), 0.09)
    assert p.moving.scale == 1.0
    p.aim(0.02)
    p.cost(Plan(1.0), 0.09)
    assert p.moving.scale == 0.35
    p.aim(0.1)
    p.cost(Plan(0.35), 0.09 * 0.35**2)
    assert p.moving.scale > 0.7


def test_frames_begin_a_period_apart_however_late_the_canvas_wakes():
    beat, now_s, begun = Beat(0.016), 100.0, []
    beat.wait_s(now_s - 0.016)
    for late_s in (0.0, 0.001, 0.004, 0.002, 0.007, 0.0, 0.001):
        begun.append(now_s)
        now_s += beat.wait_s(now_s) + late_s
    assert now_s == pytest.approx(99.992 + 7 * 0.016 + 0.001), "the first period is a half"
    assert max(np.diff(begun)) < 0.016 + 0.008


def test_a_frame_that_takes_long_is_not_made_up_for():
    beat = Beat(0.016)
    beat.wait_s(5.0)
    assert beat.wait_s(6.0) == pytest.approx(0.008), "half a period at least: the window looks at events in between"
    assert beat.wait_s(6.008) == pytest.approx(0.016)


def test_a_frame_that_an_event_brings_early_delays_none():
    beat = Beat(0.016)
    beat.wait_s(5.0)
    assert beat.wait_s(5.001) == pytest.approx(0.016)


# Costs before the frames in motion (scale, seconds); a frame's seconds whatever its size, and those per full picture;
# frames; the range of sizes in which it settles.
HISTORIES = {
    "the first frame waits for its shaders": (((None, 3.0),), 0.15, 0.05, 60, (0.35, 1.0)),
    "a busy machine: a smaller frame was slower once": (((0.25, 0.22), (0.18, 0.25)), 0.1, 2.0, 60, (0.18, 0.4)),
    "too slow an adapter: larger sizes are tried ever less often": ((), 0.06, 0.8, 300, (0.18, 0.25)),
    "the only frame of the least size waits for its shaders": (((0.5, 0.46), (0.18, 1.7)), 0.15, 0.6, 40, (0.18, 0.5)),
}


@pytest.mark.parametrize("history", HISTORIES)
def test_sizes_in_motion_settle(history):
    begins, whatever_s, full_s, frames, (low, high) = HISTORIES[history]
    p, seen = pacer(slow_adapter=True), []
    for scale, seconds in begins:
        p.cost(p.moving if scale is None else Plan(scale, mirrors=False), seconds)
    for _ in range(frames):
        seen.append(p.moving.scale)
        p.cost(p.moving, whatever_s + full_s * p.moving.scale**2)
    assert low <= min(seen[-20:]) and max(seen[-20:]) <= high
    assert sum(a != b for a, b in itertools.pairwise(seen[-20:])) <= 2, "it does not swing"
