"""Ceilings of input: the largest size of each kind of file, and the largest counts that a file may request.

Input beyond a ceiling raises `UserError`, with the ceiling and the value found, before memory is allocated for it.
`NAME_BYTES` are file sizes, for `inputs.read_bytes`; the others are counts, each with its own `check`.
docs/reliability.md lists all.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from lambent.core.errors import UserError

MATERIAL_BYTES = 16 << 20
FITS_BYTES = 16 << 20
MEASURED_BYTES = 1 << 30
CORNELL_BYTES = 256 << 20
TENSOR_BYTES = 4 << 30
SCENE_TOML_BYTES = 4 << 20
GLTF_BYTES = 4 << 30
GLTF_JSON_BYTES = 256 << 20
OBJ_BYTES = 4 << 30
MTL_BYTES = 16 << 20
PLY_BYTES = 4 << 30
BPT_BYTES = 256 << 20
MITSUBA_BYTES = 256 << 20
SERIALIZED_BYTES = 2 << 30
SPECTRUM_BYTES = 1 << 20
PICTURE_BYTES = 2 << 30
TEXTURE_BYTES = 1 << 30
VIEWS_BYTES = 64 << 20
SESSION_BYTES = 64 << 20
IES_BYTES = 16 << 20


@dataclass(frozen=True)
class Ceiling:
    """Upper limit of one count in the input; `fault` describes input that exceeds it."""

    fault: str
    most: int
    unit: str

    def check(self, found: int, *, file: Path | str | None = None, field: str | None = None, got: str = "") -> None:
        """Raise `UserError` if `found` exceeds the limit; `got` describes it in other words."""
        if found > self.most:
            expected = f"at most {self.most} {self.unit}"
            raise UserError(self.fault, file=file, field=field, got=got or f"{found} {self.unit}", expected=expected)


PIXELS = Ceiling("picture is too large", 1 << 26, "pixels")  # 8192 x 8192: 800 MB as float32 RGB
SURROUNDINGS_PIXELS = Ceiling("picture is too large", 1 << 27, "pixels")  # 16384 x 8192
LOBES = Ceiling("too many lobes", 64, "lobes")
TRIANGLES = Ceiling("scene is too large", 20_000_000, "triangles")
CORNERS = Ceiling("scene is too large", 240_000_000, "corners of faces")
FACE_CORNERS = Ceiling("face has too many corners", 1 << 16, "corners")
MATERIALS = Ceiling("too many materials", 65_536, "materials")
VARIANTS = Ceiling("too many variants", 256, "variants")
NODES = Ceiling("too many nodes", 1_000_000, "nodes")
ELEMENTS_READ = Ceiling("meshes are too large", 300_000_000, "numbers of accessors")
ZEROS = Ceiling("too many zeros", 4_000_000, "numbers of accessors without a buffer view")
TOML_LEVELS = Ceiling("key has too many levels", 64, "levels")
XML_ELEMENTS = Ceiling("too many elements", 1_000_000, "elements")
XML_LEVELS = Ceiling("too many levels", 64, "levels")
XML_FILES = Ceiling("too many included files", 64, "files")
XML_TEXT = Ceiling("text is too long after its parameters are filled in", 1 << 20, "characters")
XML_PLUGINS = Ceiling("scene has too many plugins", 400_000, "plugins")
XML_NESTING = Ceiling("is nested too deep", 32, "plugins within plugins")
SERIALIZED_VERTICES = Ceiling("mesh is too large", 60_000_000, "vertices")
IES_ANGLES = Ceiling("photometry is too large", 4096, "angles")
GRID_POINTS = Ceiling("grid has too many points", 100_000, "points")
WAVELENGTHS = Ceiling("spectrum is too long", 4096, "wavelengths")
