"""Pictures of a world in every state that Blender has them in: on disk, packed, made there, in floats and bytes."""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import bpy
from building import empty_scene

SIZE, VALUE = (4, 2), (0.5, 0.25, 1.0, 1.0)


def build(folder: Path) -> dict:
    from lambent_blender.files import Copies
    from lambent_blender.surroundings import image_file

    empty_scene()
    notes: list[str] = []
    copies = Copies(folder, notes.append)
    found = {name: image_file(image, copies, "world") for name, image in _images(folder).items()}
    return {"files": found, "notes": notes}


def _images(folder: Path) -> dict:
    made = {"floats": _filled("floats", float_buffer=True), "bytes": _filled("bytes"), "packed": _filled("packed.png")}
    made["packed"].pack()
    for name, ending, kind in (("targa", "tga", "TARGA"), ("on disk", "png", "PNG"), ("packed later", "png", "PNG")):
        image = _filled(name)
        image.file_format, image.filepath_raw = kind, str(folder / f"{name}.{ending}")
        image.save()
        made[name] = bpy.data.images.load(image.filepath_raw)
    made["packed later"].pack()
    (folder / "packed later.png").unlink()
    made["missing"] = bpy.data.images.new("missing", *SIZE)
    made["missing"].source, made["missing"].filepath = "FILE", str(folder / "missing.tga")
    return made


def _filled(name, **options):
    image = bpy.data.images.new(name, *SIZE, **options)
    image.pixels = VALUE * (SIZE[0] * SIZE[1])
    return image


if __name__ == "__main__":
    sys.stdout.write(f"\ntruth: {json.dumps(build(Path(sys.argv[1])))}\n")
