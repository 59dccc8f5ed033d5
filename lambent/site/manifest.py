"""The manifest of a site: the objects of WebGPU that a frame is made of, and its passes, as JSON.

Objects of each kind are lists; others name them by their place. Keys and values are those of WebGPU's descriptors, so
that the page passes them on as they are.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.files import write_bytes
from lambent.realtime.gpu.commands import Commands, RenderPass
from lambent.realtime.gpu.described import DescribedDevice, Made
from lambent.realtime.gpu.pipelines import VERTEX_FLOATS
from lambent.realtime.gpu.read_back import BLOCKS, buffer_bytes, texel, texture_levels
from lambent.realtime.planar.planar_view import whole_window
from lambent.site.blocks import blocks_of
from lambent.site.chunks import TALLEST_PX, Chunks, Packing
from lambent.site.standins import LARGE, standin
from lambent.site.vertices import UNITS, words_of

VERTEX, INDEX = 0x20, 0x10  # usages of buffers
FACES = 6  # of a cube
COPY_SRC, STORAGE_BINDING = 0x1, 0x8  # of textures
COLOURS = "rgba8unorm-srgb"  # of textures
CANVAS = "canvas"  # stands for the texture that is shown, and for the size of textures that follow it
MIRROR = "mirror"  # for the size of buffers of mirrored views (`whole_window`)


class Manifest:
    """Gathers what a frame is made of."""

    def __init__(
        self, device: DescribedDevice, folder: Path, size: tuple[int, int], shown: Any, in_blocks: bool = True
    ) -> None:
        """`shown` is the view of the display image, of `size`.

        `in_blocks`: cube maps are also there as BC6H, for adapters that have it. Mixes of light cannot be written so.
        """
        self._in_blocks = in_blocks
        self._device, self._folder, self._size, self._shown = device, folder, size, shown
        self._mirrored = whole_window(size)
        self.chunks = Chunks(folder)
        self.tables: dict[str, list[Any]] = defaultdict(list)
        self._places: dict[int, int] = {}
        self._drawn: set[int] = set()  # textures that frames draw into
        self.passes: list[dict[str, Any]] = []
        self._passes: dict[str, int] = {}  # places, by content
        self._equal: dict[str, int] = {}  # places of objects, by kind and description
        self._written: set[int] = set()  # buffers that the page writes for each frame
        self._data: dict[tuple[str, int], Any] = {}  # objects with content, by kind and place

    def state(self, frames: dict[str, Commands]) -> dict[str, Any]:
        """A state of the room: its frames, how many objects of each kind exist then, and contents other than at first.

        A frame is the places of its passes in the table of passes. The contents of the first state are those of the
        tables.
        """
        known = {place: dict(self.tables[place[0]][place[1]].get("data", {})) for place in self._data}
        self._drawn |= {
            id(self._device.made[id(view)].descriptor["texture"])
            for commands in frames.values()
            for one in commands.passes
            for view in _attached(one)
        }
        found = {name: [self._place_of(one) for one in commands.passes] for name, commands in frames.items()}
        changes = defaultdict[str, dict[int, Any]](dict)
        for (kind, at), before in known.items():
            now = self._content(self._data[kind, at])
            if now["file"] != before["file"]:
                changes[kind][at] = now
        counts = {kind: len(table) for kind, table in self.tables.items()}
        return {
            "counts": counts, "changes": changes, "frames": found,
            "finer": self._finer([one for commands in frames.values() for one in commands.passes]),
        }  # fmt: skip

    def _finer(self, passes: Sequence[RenderPass]) -> list[int]:
        """Places of textures with stand-ins, those that most draws read first, and small before large ones."""
        draws, textures = Counter[int](), self.tables["texture"]
        for one in passes:
            groups: dict[int, Any] = {}
            for name, given in one.commands:
                if name == "set_bind_group":
                    groups[given[0]] = self.tables["bind_group"][self.refer(given[1])]
                elif name.startswith("draw"):
                    views = {
                        entry["view"] for group in groups.values() for entry in group["entries"] if "view" in entry
                    }
                    draws.update(self.tables["view"][view]["texture"] for view in views)
        large = [at for at, one in enumerate(textures) if "standin" in one.get("data", {})]
        return sorted(large, key=lambda at: (-draws[at], textures[at]["data"]["packed"]))

    def _place_of(self, one: RenderPass) -> int:
        """The place of a pass in the table of passes; equal ones share it."""
        described = self._pass(one)
        key = json.dumps(described, sort_keys=True)
        if key not in self._passes:
            self._passes[key] = len(self.passes)
            self.passes.append(described)
        return self._passes[key]

    def refer(self, one: Any) -> int:
        """The place of an object in the list of its kind."""
        made = self._device.made[id(one)]
        if id(one) not in self._places:
            self._places[id(one)] = self._added(made, getattr(self, f"_{made.kind}")(made))
        return self._places[id(one)]

    def written(self, buffer: Any) -> int:
        """The place of a buffer that the page writes for each frame: it has no content here."""
        self._written.add(id(buffer))
        return self.refer(buffer)

    def _added(self, made: Made, described: dict[str, Any]) -> int:
        """The place of a new object. Objects without content of their own share that of an equal one."""
        key, table = json.dumps([made.kind, described], sort_keys=True), self.tables[made.kind]
        has_content = made.kind in ("buffer", "texture")
        if has_content or key not in self._equal:
            self._equal[key] = len(table)
            if "data" in described:
                self._data[made.kind, len(table)] = made.one
            table.append(described)
        return self._equal[key]

    def _pass(self, one: RenderPass) -> dict[str, Any]:
        colours = [{**camel(a), "view": self._view_or_canvas(a["view"])} for a in one.attachments["color_attachments"]]
        depth = one.attachments.get("depth_stencil_attachment")
        found: dict[str, Any] = {"colorAttachments": colours}
        if depth is not None:
            found["depthStencilAttachment"] = {**camel(depth), "view": self.refer(depth["view"])}
        if one.view is not None:
            found["view"] = one.view
        if (camera := self._camera(one)) is not None:
            found["camera"] = camera
        found["commands"] = [[_word(name), *map(self._argument, given)] for name, given in one.commands]
        return found

    def _camera(self, one: RenderPass) -> int | None:
        """The place of the buffer with the camera's record, if a pass reads one: the first entry of group 0."""
        group = next((given[1] for name, given in one.commands if name == "set_bind_group" and given[0] == 0), None)
        if group is None:
            return None
        found = self._device.made[id(group)].descriptor["entries"][0]["resource"]
        return self.refer(found["buffer"]) if isinstance(found, dict) else None

    def _view_or_canvas(self, view: Any) -> int | str:
        return CANVAS if view is self._shown else self.refer(view)

    def _argument(self, one: Any) -> Any:
        return self.refer(one) if id(one) in self._device.made else one

    def _buffer(self, made: Made) -> dict[str, Any]:
        found = {"usage": made.descriptor["usage"], "size": made.one.size}
        return found if id(made.one) in self._written else {**found, "data": self._content(made.one)}

    def _texture(self, made: Made) -> dict[str, Any]:
        size, drawn = tuple(made.one.size), id(made.one) in self._drawn
        follows = {self._size: CANVAS, self._mirrored: MIRROR}.get(size[:2]) if drawn else None
        found = {
            **camel(made.descriptor), "size": [follows, follows, *size[2:]] if follows else list(size),
            "format": made.one.format,
        }  # fmt: skip
        return found if drawn else {**found, "data": self._with_standin(made.one)}

    def _with_standin(self, texture: Any) -> dict[str, Any]:
        """Where the content of a texture is, and what stands in for it until it has arrived, if it is large."""
        levels = texture_levels(self._device, texture)
        content = self._texels(texture, levels)
        if content.get("blocks", content)["packed"] < LARGE:
            return content
        found = standin(texture.format, texture.size, levels)
        if found is None:
            return content
        finest, levels = found
        piece = self.packed_texels(texture.format, texture.size[2], levels)
        return {**content, "standin": {**piece, "finest": finest}}

    def _content(self, one: Any) -> dict[str, Any]:
        """Where the present content of a buffer or texture is."""
        made = self._device.made[id(one)]
        if made.kind == "texture":
            return self._texels(one, texture_levels(self._device, one))
        data, usage = buffer_bytes(self._device, one), made.descriptor["usage"]
        if (
            usage & VERTEX
            and (words := words_of(np.frombuffer(data, np.float32).reshape(-1, VERTEX_FLOATS))) is not None
        ):
            return {**self.chunks.add_table(words), "units": UNITS}
        channels = VERTEX_FLOATS if usage & VERTEX else 3 if usage & INDEX else 1
        packing = Packing(4, channels, [(len(data) // 4, 0)]) if len(data) % (4 * channels) == 0 else None
        return self.chunks.add(data, packing)

    def _texels(self, texture: Any, levels: list[bytes]) -> dict[str, Any]:
        if texture.format in BLOCKS:
            return self.chunks.add(b"".join(levels))
        if texture.format == COLOURS and (picture := _picture(texture, levels)):
            return self.chunks.add_picture(picture)
        found = self.packed_texels(texture.format, texture.size[2], levels)
        if self._in_blocks and (blocks := blocks_of(texture.format, texture.size, levels)):
            found["blocks"] = self.chunks.add(blocks)
        return found

    def place_of(self, one: Any) -> int | None:
        """The place of an object that a frame uses; None of another."""
        return self._places.get(id(one))

    def resource(self, group: Any, binding: int) -> Any:
        """The buffer, or the texture of the view, that a bind group has at a binding."""
        found = self._device.made[id(group)].descriptor["entries"][binding]["resource"]
        return found["buffer"] if isinstance(found, dict) else self.texture_of(found)

    def texture_of(self, view: Any) -> Any:
        """The texture of a view."""
        return self._device.made[id(view)].descriptor["texture"]

    def floats(self, buffer: Any, offset: int, count: int) -> NDArray[np.float32]:
        """Numbers that a buffer holds at `offset` bytes."""
        return np.frombuffer(buffer_bytes(self._device, buffer), np.float32, count, offset)

    def let_mix(self, place: int) -> None:
        """Let the page copy a texture, and write mixes into it."""
        self.tables["texture"][place]["usage"] |= COPY_SRC | STORAGE_BINDING

    def packed_texels(self, format: str, layers: int, levels: list[bytes]) -> dict[str, Any]:
        """Where the MIP levels of a texture of this format and so many layers are."""
        word, channels = texel(format)
        runs = [(len(level) // word, len(level) // word // layers * FACES if layers > FACES else 0) for level in levels]
        return self.chunks.add(b"".join(levels), Packing(word, channels, runs))

    def _view(self, made: Made) -> dict[str, Any]:
        descriptor = {key: value for key, value in made.descriptor.items() if key != "texture"}
        return {"texture": self.refer(made.descriptor["texture"]), **camel(descriptor)}

    def _sampler(self, made: Made) -> dict[str, Any]:
        return dict(camel(made.descriptor))

    def _bind_group_layout(self, made: Made) -> dict[str, Any]:
        return dict(camel(made.descriptor))

    def _bind_group(self, made: Made) -> dict[str, Any]:
        entries = []
        for entry in made.descriptor["entries"]:
            one = entry["resource"]["buffer"] if isinstance(entry["resource"], dict) else entry["resource"]
            entries.append({"binding": entry["binding"], self._device.made[id(one)].kind: self.refer(one)})
        return {"layout": self.refer(made.descriptor["layout"]), "entries": entries}

    def _pipeline_layout(self, made: Made) -> dict[str, Any]:
        return {"bindGroupLayouts": [self.refer(one) for one in made.descriptor["bind_group_layouts"]]}

    def _shader_module(self, made: Made) -> dict[str, Any]:
        code = made.descriptor["code"].encode()
        name = f"shaders/{hashlib.sha256(code).hexdigest()[:20]}.wgsl"
        write_bytes(self._folder / name, code)
        return {"file": name}

    def _render_pipeline(self, made: Made) -> dict[str, Any]:
        found = {key: value for key, value in made.descriptor.items() if value is not None}
        for stage in ("vertex", "fragment"):
            if stage in found:
                found[stage] = {**found[stage], "module": self.refer(found[stage]["module"])}
                found[stage] = {key: value for key, value in found[stage].items() if value != ""}
        return dict(camel({**found, "layout": self.refer(found["layout"])}))


def _picture(texture: Any, levels: list[bytes]) -> list[NDArray[np.uint8]]:
    """The levels (rows, columns, 4) of a texture that fits into a picture; else none."""
    width, height, layers = texture.size
    if layers > 1 or 2 * height > TALLEST_PX or width > TALLEST_PX:
        return []
    sizes = [(max(1, height >> level), max(1, width >> level), 4) for level in range(len(levels))]
    return [np.frombuffer(level, np.uint8).reshape(size) for level, size in zip(levels, sizes, strict=True)]


def _attached(one: RenderPass) -> list[Any]:
    depth = one.attachments.get("depth_stencil_attachment")
    return [a["view"] for a in one.attachments["color_attachments"]] + ([depth["view"]] if depth else [])


def camel(value: Any) -> Any:
    """A descriptor of wgpu in the words of WebGPU: keys in camelCase, but for the constants of shaders."""
    if isinstance(value, dict):
        return {_word(key): one if key == "constants" else camel(one) for key, one in value.items()}
    return [camel(one) for one in value] if isinstance(value, list | tuple) else value


def _word(snake: str) -> str:
    return re.sub("_([a-z0-9])", lambda match: match[1].upper(), snake)
