"""Exchanges the texture of a material for none, another material's, or an image of the user."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from lambent.core.errors import UserError
from lambent.core.plain import Triple
from lambent.materials.factored.albedo import possible_kd
from lambent.scenes.looks.image_textures import MOST_REPEAT, mean_and_detail
from lambent.scenes.scene import ImageTexture, MaterialTextures, Texture
from lambent.store.kept.images import kept_image, located
from lambent.viewer.editor.files import typed_path
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.modes.walk.session.thumbnails import Thumbnail, Thumbnails, texture_thumbnail
from lambent.viewer.screen import Screen

OWN, NONE = "its own", "none"
ENDINGS = (".png", ".jpg", ".jpeg", ".bmp", ".tga", ".tif", ".tiff", ".webp", ".gif", ".exr", ".hdr")
LEAST_REPEAT, MOST_SHOWN_REPEAT = 0.05, 50.0  # of the slider


@dataclass
class Texturing:
    """Textures of materials in the edited room.

    Attributes
    ----------
    textures : mapping
        The scene's, by material.
    without_uv : collection of str
        Materials without texture coordinates.
    keeps : callable
        Whether images are copied into `store`; otherwise states name them where they are.
    """

    edits: MaterialEdits
    screen: Screen
    store: Path | None = None
    keeps: Callable[[], bool] = lambda: True
    textures: Mapping[str, MaterialTextures] = field(default_factory=dict)
    without_uv: Collection[str] = ()
    typed: str = ""  # path of an image, as typed

    def __post_init__(self) -> None:
        self.thumbnails = Thumbnails(self.screen.images)

    def choices(self, name: str) -> dict[str, str | ImageTexture | None]:
        """What a material can show, by label; None for its own texture, or for none if it has no own."""
        others = [other for other in self.textures if other != name]
        last: dict[str, str | ImageTexture | None] = {f"of {other}": other for other in others}
        used = self.edits.room.textures.get(name)
        if isinstance(used, ImageTexture):
            last[label_of(used)] = used
        return {**({OWN: None, NONE: ""} if name in self.textures else {NONE: None}), **last}

    def shown(self, name: str) -> str:
        """The label of the present choice."""
        used = self.edits.room.textures.get(name)
        return next((label for label, of in self.choices(name).items() if of == used), NONE)

    def thumbnail(self, name: str, of: str | ImageTexture | None) -> str | None:
        """Name of the thumbnail of a choice of `choices`, see `Thumbnails.get`; None for none."""
        if isinstance(of, ImageTexture):
            file = Path(located(of, self.store).file)
            return self.thumbnails.get(file, lambda: _thumbnail(*mean_and_detail(file)))
        source = name if of is None else of
        if source not in self.textures:
            return None
        kd, diffuse = self.edits.scene[source].kd, self.textures[source].diffuse
        return self.thumbnails.get((source,), lambda: _thumbnail(kd, diffuse))

    def choose(self, name: str, of: str | ImageTexture | None) -> None:
        """Show a texture, with its mean as the diffuse colour, as one stroke."""
        try:
            mean = self._mean(name, of)
            self.edits.set_texture(name, of, mean and possible_kd(self.edits.current(name), mean))
        except UserError as error:
            self.screen.say(f"not shown: {error}")

    def _mean(self, name: str, of: str | ImageTexture | None) -> Triple | None:
        """The colour that a texture brings; None to keep the present one."""
        if isinstance(of, ImageTexture):
            return mean_and_detail(Path(located(of, self.store).file)).mean
        source = name if of is None else of
        has_colour = source in self.textures and self.textures[source].diffuse is not None
        return self.edits.scene[source].kd if has_colour else None

    def open(self, name: str | None, text: str) -> None:
        """Show the image of a typed or dropped path on a material."""
        if name is None:
            self.screen.say("select an object first: the image becomes the texture of its material")
            return
        try:
            if name in self.without_uv:
                raise UserError("has no texture coordinates", field=name)
            file = typed_path(text).absolute()
            mean_and_detail(file)
            self.choose(name, ImageTexture(self._kept(file)))
        except UserError as error:
            self.screen.say(f"not shown: {error}")
        else:
            self.screen.say(f"{file.name} is the texture of {name}")

    def _kept(self, file: Path) -> str:
        if self.store is None or not self.keeps():
            return str(file)
        try:
            return kept_image(self.store, file)
        except UserError as error:
            self.screen.say(f"the image stays where it is: {error}")
            return str(file)

    def repeat(self, name: str, times: float) -> None:
        """Repeat the image of a material this many times, within the present stroke."""
        used = self.edits.room.textures.get(name)
        if isinstance(used, ImageTexture):
            times = min(max(times, 1 / MOST_REPEAT), MOST_REPEAT)
            self.edits.show_texture(name, replace(used, repeat=times))


def _thumbnail(mean: Triple, detail: Texture | None) -> Thumbnail:
    """Thumbnail of a texture with this mean; an even one without detail."""
    texels = np.ones((1, 1, 3), np.float32) if detail is None else detail.texels
    return texture_thumbnail(np.asarray(mean, np.float32) * texels)


def label_of(image: ImageTexture) -> str:
    """An image's name for people: without the digits that tell copies apart."""
    path = Path(image.file)
    stem, dash, digest = path.stem.rpartition("-")
    copied = dash and not path.is_absolute() and len(digest) == 8
    return f"{stem if copied else path.stem}{path.suffix}"
