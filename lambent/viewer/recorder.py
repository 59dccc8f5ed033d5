"""Recording in the window: begin, walk, stop; then the draft is smoothed, tried out, and saved or thrown away."""

from __future__ import annotations

from dataclasses import dataclass

from lambent.core.camera import Camera, CameraPath
from lambent.viewer.recording import LONGEST_S, SMOOTH_S, Recording

DRAFT = "recorded"


@dataclass
class Recorder:
    """`recording` while the camera is being followed; `draft` afterwards, until it is saved or dropped."""

    recording: Recording | None = None
    taken: Recording | None = None
    draft: CameraPath | None = None
    smooth_s: float = SMOOTH_S
    began_s: float = 0.0
    name: str = ""
    suggested: str = ""  # the name as it stands before anything is typed

    @property
    def on(self) -> bool:
        return self.recording is not None

    def begin(self, now_s: float) -> None:
        """Follow the camera from now on; a draft is dropped."""
        self.drop()
        self.recording, self.began_s = Recording(), now_s

    def take(self, camera: Camera, now_s: float) -> bool:
        """The camera at this moment; whether the recording has become too long to go on."""
        if self.recording is None:
            return False
        self.recording.take(camera, now_s - self.began_s)
        return now_s - self.began_s > LONGEST_S

    def stop(self) -> CameraPath | None:
        """Make a draft of what was recorded; None where nothing moved."""
        self.taken, self.recording = self.recording, None
        self.smooth(self.smooth_s)
        return self.draft

    def smooth(self, smooth_s: float) -> None:
        """Make the draft anew, smoothed more or less."""
        self.smooth_s = smooth_s
        self.draft = None if self.taken is None else self.taken.path(DRAFT, smooth_s)

    def drop(self) -> None:
        """Forget the draft."""
        self.taken, self.draft = None, None
