"""A frame as data: its render passes, and the commands of each, in order.

Passes write into `Commands` as into an encoder of WebGPU. The native renderer then encodes them for its adapter, and
`lambent.site` writes them into the manifest of a site, whose page encodes them for the browser's. Such a frame is drawn
for other cameras: it has all faces and all mirrored views, and says what a camera leaves out or puts in order.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from lambent.core.arrays import Floats

Command = tuple[str, tuple[Any, ...]]  # the method of a render pass, and its arguments


@dataclass
class RenderPass:
    """A render pass: the arguments of `begin_render_pass`, and its commands.

    `view` is the number of the mirrored view that the pass belongs to.
    """

    attachments: dict[str, Any]
    view: int | None = None
    commands: list[Command] = field(default_factory=list)

    def set_pipeline(self, pipeline: Any) -> None:
        self.commands.append(("set_pipeline", (pipeline,)))

    def set_bind_group(self, number: int, group: Any) -> None:
        self.commands.append(("set_bind_group", (number, group)))

    def set_vertex_buffer(self, slot: int, buffer: Any) -> None:
        self.commands.append(("set_vertex_buffer", (slot, buffer)))

    def set_index_buffer(self, buffer: Any, format: str) -> None:
        self.commands.append(("set_index_buffer", (buffer, format)))

    def draw(self, vertices: int) -> None:
        self.commands.append(("draw", (vertices,)))

    def draw_indexed(self, indices: int, instances: int, first: int) -> None:
        self.commands.append(("draw_indexed", (indices, instances, first)))

    def draw_thin(self, indices: int, instances: int, first: int) -> None:
        """For other cameras: `draw_indexed` of those of the faces that may miss all pixel centres (`Clusters.thin`)."""
        self.commands.append(("draw_thin", (indices, instances, first)))

    def begin_pane(self, middle_m: Floats) -> None:
        """For other cameras: here begin the commands of a pane; a camera sorts panes by the distance of `middle_m`."""
        self.commands.append(("pane", tuple(float(x) for x in middle_m)))

    def only_upright(self) -> None:
        """For other cameras: what follows counts only on the side that the view's reflector faces."""
        self.commands.append(("only_upright", ()))

    def end(self) -> None:
        """Nothing: the next pass begins where this one has no more commands."""


@dataclass
class Commands:
    """The render passes of a frame. Those that begin now belong to the mirrored view of number `view`."""

    passes: list[RenderPass] = field(default_factory=list)
    view: int | None = None

    def begin_render_pass(self, **attachments: Any) -> RenderPass:
        self.passes.append(RenderPass(attachments, self.view))
        return self.passes[-1]

    def encode(self, encoder: Any) -> None:
        """Encode everything for an adapter."""
        for one in self.passes:
            render = encoder.begin_render_pass(**one.attachments)
            for method, arguments in one.commands:
                getattr(render, method)(*arguments)
            render.end()
