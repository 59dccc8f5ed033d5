"""Where a camera path of a store leads at a time: for the window and for films."""

from __future__ import annotations

from dataclasses import asdict

from lambent.scenes.paths import sample_path
from lambent.store.contract import CameraRecord, PathRecord


def camera_at(path: PathRecord, time_s: float) -> CameraRecord:
    """Camera of the path at `time_s` seconds, clamped to its ends; see `scenes.paths.sample_path`."""
    if len(path.keys) < 2 or path.seconds <= 0:
        return path.keys[0]
    return CameraRecord(**asdict(sample_path(path, time_s / path.seconds)))
