"""State that the passes of a frame share."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Protocol

from lambent.core.arrays import Flags
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.pipelines import cover
from lambent.realtime.gpu.structs import Record
from lambent.realtime.gpu.targets import PassTimer, Target, Targets, stored
from lambent.realtime.objects.clusters import Clusters, Seen
from lambent.realtime.objects.draws import Draw
from lambent.realtime.planar.planar_view import PlanarView
from lambent.realtime.resources import SceneResources


@dataclass
class FrameContext:
    """A frame in progress. Passes read it and store their results in it for later passes."""

    encoder: Any  # takes the passes
    state: FrameState
    data: Record  # of FRAME_DTYPE
    frame_group: Any  # group 0 of all pipelines, with `data`
    resources: SceneResources
    clusters: Clusters
    targets: Targets
    timer: PassTimer
    target: Target  # light is drawn into it
    draws: list[Draw]
    panes: list[Draw]  # clear glass, blended over everything else
    views: list[PlanarView]  # planar reflectors with a buffer in this frame
    counts: Counter[str]  # draw_calls
    shown: Any = None  # view of the texture for the display image, if any
    radiance: Any = None  # texture of linear light after the previous pass
    base: Any = None  # texture of the last frame of few samples, if this frame is drawn over it
    redrawn: frozenset[str] | None = None  # materials; only their objects are drawn over `base`
    light: tuple[Any, ...] = ()  # resources of group 3: light maps, the sun, and its visible share by pixel
    pane_light: tuple[Any, ...] = ()  # `light` for panes
    reflections: Any = None  # group 3 of draws with pixels on planar reflectors
    whole: bool = False  # for other cameras: with faces out of view, and all mirrored views

    @property
    def is_passing(self) -> bool:
        """Whether the frame is shown by itself: half floats suffice, and edges of masked surfaces can be blended."""
        return self.shown is not None and self.state.accumulate is None

    @property
    def is_smoothed(self) -> bool:
        """Whether edges of the display image are blended."""
        return self.is_passing and self.state.is_smoothed

    @property
    def blends_masks(self) -> bool:
        """Whether pixels that masked surfaces cover in part are blended with the background."""
        return self.is_smoothed and bool(self.resources.masked)

    @property
    def is_covered(self) -> bool:
        """Whether pixels show the mean over several places. Frames drawn over a base keep the base's pixels."""
        return self.is_smoothed and self.state.covers and self.redrawn is None

    @property
    def unsmoothed(self) -> Any:
        """Texture of the display image before its edges are blended; None without blending."""
        return self.targets.display("unsmoothed", self.state.size) if self.is_smoothed else None

    def seen(self, among: Flags | bool = True) -> Seen:
        """The clusters, of those `among` which it looks, that the frame's camera may see."""
        if self.whole:
            return self.clusters.whole(among)
        return self.clusters.seen(self.data["clip_from_world"].T, among)

    def thin(self) -> Seen:
        """The faces in view that may miss all pixel centres."""
        if self.whole:
            return replace(self.clusters.whole(), thin=True)
        return self.clusters.thin(self.data["clip_from_world"].T, self.state.height)

    def begin(self, name: str, views: Iterable[Any], load_op: str, depth: str = "load") -> Any:
        """A render pass into `views` and the target's depth, which it loads or clears; group 0 is set."""
        render = self.encoder.begin_render_pass(
            color_attachments=stored(views, load_op),
            depth_stencil_attachment={
                "view": self.target.depth.create_view(), "depth_clear_value": 0.0, "depth_load_op": depth,
                "depth_store_op": "store",
            },
            **self.timer.writes(name),
        )  # fmt: skip
        render.set_bind_group(0, self.frame_group)
        return render

    def cover(self, name: str, views: Iterable[Any], pipeline: Any, groups: Iterable[Any]) -> None:
        """A render pass of a `screen_pipeline` into `views`."""
        cover(self.encoder, views, pipeline, groups, self.timer.writes(name))


class Pass(Protocol):
    """A step of a frame; does nothing if the frame does not need it."""

    def encode(self, context: FrameContext) -> None: ...
