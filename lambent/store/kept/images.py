"""Images that replace textures in the states of a room: copies in the store's folder, so that a moved file stays shown.

A state, or a variant of the scene, names a copy by its file name in IMAGES; a state names an image elsewhere by its
absolute path, if the store was not writable. Bakes add the images of variants.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from lambent.core.ceilings import TEXTURE_BYTES
from lambent.core.errors import UserError
from lambent.core.files import inside, write_bytes
from lambent.core.inputs import read_bytes
from lambent.core.plain import plain_name
from lambent.scenes.looks.image_textures import mean_and_detail
from lambent.scenes.scene import ImageTexture, Look, Variant

IMAGES = "images"
Textures = Mapping[str, str | ImageTexture]  # by material, as of `session.RoomState.textures`


def kept_image(folder: Path, file: Path) -> str:
    """Copy an image into the store's folder; returns the name of the copy, the same for the same content.

    Raises
    ------
    UserError
        If the file cannot be read or the copy cannot be written.
    """
    content = read_bytes(file, TEXTURE_BYTES)
    digest = hashlib.sha256(content).hexdigest()[:8]
    name = f"{plain_name(file.stem, 'image')}-{digest}{file.suffix.lower()}"
    copy = folder / IMAGES / name
    if not copy.exists():
        write_bytes(copy, content)
    return name


def with_kept_images(folder: Path, variants: Sequence[Variant]) -> tuple[Variant, ...]:
    """Variants of a scene as a store keeps them: with copies of their images; raises as `kept_image`."""
    return _changed(variants, lambda image: replace(image, file=kept_image(folder, Path(image.file))))


def with_located_images(variants: Sequence[Variant], folder: Path) -> tuple[Variant, ...]:
    """Variants of a store with absolute paths of their images; raises as `located`."""
    return _changed(variants, lambda image: located(image, folder))


def _changed(variants: Sequence[Variant], change: Callable[[ImageTexture], ImageTexture]) -> tuple[Variant, ...]:
    def look_of(look: Look) -> Look:
        return replace(look, textures=change(look.textures)) if isinstance(look.textures, ImageTexture) else look

    return tuple(replace(one, looks={name: look_of(look) for name, look in one.looks.items()}) for one in variants)


def located(image: ImageTexture, folder: Path | None) -> ImageTexture:
    """An image of a state with its absolute path; `UserError` if its name leaves the store's folder."""
    if folder is None or Path(image.file).is_absolute():
        return image
    return replace(image, file=str(inside(folder / IMAGES, image.file)))


def with_paths(textures: Textures, folder: Path | None) -> dict[str, str | ImageTexture]:
    """Textures of a state with absolute paths of images; raises as `located`."""
    return {name: located(of, folder) if isinstance(of, ImageTexture) else of for name, of in textures.items()}


def readable(textures: Textures, folder: Path | None) -> tuple[dict[str, str | ImageTexture], tuple[str, ...]]:
    """Textures of a state with absolute paths, without images that cannot be read; and a line on each of these."""
    found, faults = dict[str, str | ImageTexture](), list[str]()
    for name, of in textures.items():
        try:
            shown = located(of, folder) if isinstance(of, ImageTexture) else of
            if isinstance(shown, ImageTexture):
                mean_and_detail(Path(shown.file))
        except UserError as error:
            faults.append(f"{name} shows its own texture: {error}")
        else:
            found[name] = shown
    return found, tuple(faults)


def names_of_images(textures: Textures) -> Iterator[str]:
    """The files of images among the textures of a state, as it names them."""
    return (of.file for of in textures.values() if isinstance(of, ImageTexture))


def remove_unused(folder: Path, used: Collection[str]) -> None:
    """Delete copies of images that neither a state nor a variant uses."""
    if (folder / IMAGES).is_dir():
        for copy in (folder / IMAGES).iterdir():
            if copy.is_file() and copy.name not in used:
                copy.unlink(missing_ok=True)
