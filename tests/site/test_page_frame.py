"""Parity of what the page computes for each frame with Python: what a camera sees, and what it sees mirrored."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState, frame_data
from lambent.realtime.gpu.structs import MIRRORED_VIEW_DTYPE, PLAN_DTYPE
from lambent.realtime.objects.clusters import MERGED_GAP, Clusters, merged
from lambent.realtime.planar.planar_view import (
    MOST_LEVELS,
    levels_of,
    planar_views,
    whole_window,
)
from lambent.realtime.planar.reflector_faces import outline_triangles, shares_on_screen
from lambent.site.cameras import reflector_for_page
from lambent.store.contract import ObjectRecord, PlanRecord, ReflectorPart, ReflectorRecord
from tests.site.test_page_modules import CAMERAS, said

SIZE = 640, 360
NEAR_M = 0.013
BOUNDS = ((-3.0, 0.0, -4.0), (5.0, 2.7, 6.0))


def frame_of(camera: Camera, jitter=(0.0, 0.0), size=SIZE):
    return frame_data(FrameState(camera, *size, near_m=NEAR_M, jitter_px=tuple(jitter)), BOUNDS)


def objects(counts, luminaire=None):
    starts = np.cumsum([0, *counts])
    return [
        ObjectRecord(
            name=f"o{k}", material="m", emission=(0, 0, 0), first_face=int(first), face_count=int(count),
            bounds=((0, 0, 0), (1, 1, 1)), luminaire=luminaire if k == 2 else None,
        )
        for k, (first, count) in enumerate(zip(starts, counts, strict=False))
    ]  # fmt: skip


@pytest.fixture(scope="module")
def clusters():
    """Of 900 triangles within 20 m, slivers and specks among them, one of 50 km, one without a place, and a lamp."""
    rng = np.random.default_rng(3)
    middle = rng.uniform(-10, 10, (900, 1, 3))
    middle = middle[np.lexsort((middle[:, 0, 2], np.floor(middle[:, 0, 0])))]
    corners = middle + rng.normal(0, 1, (900, 3, 3)) * 10 ** rng.uniform(-4, 0.3, (900, 1, 1))
    corners[:200, :, 1] = middle[:200, :, 1] + 1e-4 * corners[:200, :, 1]
    corners[500] = [[-5e4, 0, -5e4], [5e4, 0, -5e4], [0, 0, 5e4]]
    corners[640, 1, 2] = np.nan
    return Clusters(corners.reshape(-1, 3), np.arange(2700).reshape(-1, 3), objects([130, 500, 70, 200], luminaire=0))


@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: camera.name)
def test_cameras_see_the_same_faces(javascript, clusters, camera):
    places, sizes = clusters.table()
    given = {
        "camera": said(camera), "size": SIZE, "near": NEAR_M, "places": places.ravel().tolist(),
        "sizes": [repr(float(one)) for one in sizes.ravel()],
    }  # fmt: skip
    code = """import {frameOf} from './camera.js'; import {Clusters, within} from './culling.js';
    const number = (text) => ({nan: NaN, inf: Infinity, '-inf': -Infinity})[text] ?? Number(text);
    const clusters = new Clusters(new Uint32Array(given.places), new Float32Array(given.sizes.map(number)));
    const {rows} = frameOf(given.camera, ...given.size, given.near), visible = clusters.visible(rows);
    const seen = clusters.runs(visible), thin = clusters.runs(clusters.thin(rows, given.size[1], visible));
    const ranges = [[0, 130], [130, 500], [630, 70], [0, 900], [300, 40]];
    say({seen, thin, within: ranges.map((one) => within(seen, ...one))});"""
    found, clip = javascript(code, given), frame_of(camera)["clip_from_world"].T
    seen, thin = clusters.seen(clip), clusters.thin(clip, SIZE[1])
    assert found["seen"] == [[begin, end] for begin, end in zip(seen.begin, seen.end, strict=True)]
    assert found["thin"] == [[begin, end] for begin, end in zip(thin.begin, thin.end, strict=True)]
    wanted = [seen.of(*one) for one in ((0, 130), (130, 500), (630, 70), (0, 900), (300, 40))]
    assert [[tuple(run) for run in runs] for runs in found["within"]] == wanted


def test_some_faces_are_seen_and_some_are_not(clusters):
    seen = [clusters.seen(frame_of(camera)["clip_from_world"].T) for camera in CAMERAS[:3]]
    assert all(0 < sum(one.end) - sum(one.begin) < 900 for one in seen)
    assert merged([(0, 3), (3 + MERGED_GAP - 1, 400)], MERGED_GAP) == [(0, 400)]


FLOOR = ((-3.0, 0.0, -4.0), (-3.0, 0.0, 6.0), (5.0, 0.0, 6.0), (5.0, 0.0, -4.0))
REFLECTORS = [
    ReflectorRecord(
        plane=(0.0, 1.0, 0.0, 0.0), outline=FLOOR, deviation_m=0.004,
        parts=(ReflectorPart(object="floor", faces=(), area_m2=1.0),),
        plan=PlanRecord(
            corner=(-3.0, 0.0, -4.0), across=(1.0, 0.0, 0.0), along=(0.0, 0.0, 1.0), cell_m=0.02, rows=500, columns=400,
            packed="",
        ),
    ),
    ReflectorRecord(
        plane=(0.6, 0.0, 0.8, -0.2), two_sided=True, parts=(ReflectorPart(object="mirror", faces=(), area_m2=1.0),),
        outline=((0.6, 0.2, -0.2), (-0.2, 0.2, 0.4), (-0.2, 2.2, 0.4), (0.6, 2.2, -0.2)),
    ),
    ReflectorRecord(
        plane=(0.0, 0.0, -1.0, 6.0), parts=(ReflectorPart(object="wall", faces=(), area_m2=1.0),),
        outline=((-3.0, 0.0, 6.0), (-3.0, 2.7, 6.0), (5.0, 2.7, 6.0), (5.0, 0.0, 6.0)),
    ),
]  # fmt: skip
WIDEST = {"floor": 0.16, "mirror": 0.02, "wall": 0.3}


MIRRORED = """import {frameOf} from './camera.js'; import {mirroredViews, shareOf} from './mirrors.js';
const frame = frameOf(given.camera, ...given.size, given.near, given.jitter);
const corners = given.corners.map((one) => new Float32Array(one));
say({shares: corners.map((one) => shareOf(one, frame.rows)),
     views: mirroredViews(given.reflectors, corners, given.widest, frame, given.size, 2)});"""


def reflecting(reflectors, faces):
    corners = [outline_triangles(one).astype(np.float32).ravel().tolist() for one in faces]
    return {"reflectors": [reflector_for_page(one) for one in reflectors], "corners": corners}


@pytest.mark.parametrize(("size", "jitter"), [((640, 360), (0.0, 0.0)), ((97, 211), (0.4, -0.2)), ((960, 540), (0, 0))])
@pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: camera.name)
def test_mirrored_views_are_those_of_python(javascript, camera, size, jitter):
    """Their windows too, which move by other steps in smaller frames."""
    given = {
        "camera": said(camera), "size": size, "near": NEAR_M, "jitter": jitter, **reflecting(REFLECTORS, REFLECTORS),
        "widest": dict(enumerate(WIDEST.values())),
    }  # fmt: skip
    found, frame = javascript(MIRRORED, given), frame_of(camera, jitter, size)
    shares = np.array([shares_on_screen(frame, outline_triangles(one)).sum() for one in REFLECTORS])
    np.testing.assert_allclose(found["shares"], shares, rtol=1e-4, atol=1e-6)
    wanted = planar_views(frame, REFLECTORS, *size, 2, WIDEST, shares)
    assert [REFLECTORS[one["number"]] for one in found["views"]] == [view.reflector for view in wanted]
    for one, view in zip(found["views"], wanted, strict=True):
        names = "clip_from_world", "eye", "across", "up", "forward", "show"
        assert_equal({name: one["frame"][name] for name in names}, view.frame)
        assert_equal(one["view"], view.uniform)
        assert {*one["view"]} == {*MIRRORED_VIEW_DTYPE.fields} and one["view"]["size"] == list(view.size)
        assert (np.array(view.size) <= whole_window(size)).all()
        assert (one["plan"] is None) == (view.plan is None)
        if view.plan is not None:
            assert {*one["plan"]} == {*PLAN_DTYPE.fields} - {"_pad"}
            assert_equal(one["plan"], view.plan)


def test_no_view_of_an_outline_outside_the_frame(javascript):
    """Faces may lie beside their reflector's plane, and in the frame."""
    behind, share = REFLECTORS[2], 0.3
    assert planar_views(frame_of(CAMERAS[0]), [behind], *SIZE, 2, WIDEST, np.array([share])) == []
    given = {
        "camera": said(CAMERAS[0]), "size": SIZE, "near": NEAR_M, "jitter": (0, 0), "widest": {0: share},
        **reflecting([behind], REFLECTORS[:1]),
    }  # fmt: skip
    found = javascript(MIRRORED, given)
    assert found["shares"][0] > 0.1 and found["views"] == []


def assert_equal(found, record):
    for name, values in found.items():
        wanted = record[name].ravel()[: len(values)]
        scale = max(1e-3, float(np.abs(wanted).max()))
        np.testing.assert_allclose(values, wanted, rtol=2e-5, atol=4e-6 * scale, err_msg=name)


def test_windows_have_all_levels():
    for size in ((640, 360), (96, 64), (1, 1), (3840, 2160), (333, 777)):
        assert levels_of(whole_window(size)) == MOST_LEVELS
