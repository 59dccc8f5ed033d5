"""Which of a scene's materials are clear glass, that the sun passes straight on."""

from __future__ import annotations

from lambent.materials.clear import clear_terms
from lambent.materials.document import Material
from lambent.scenes.scene import MaterialTextures, Scene


def is_clear(material: Material, textures: MaterialTextures | None) -> bool:
    """Whether a surface passes light straight on, as `materials.clear` has it, without textures that spread it."""
    even = textures is None or (textures.roughness is None and textures.normal is None)
    return even and clear_terms(material) is not None


def panes_of(scene: Scene) -> tuple[str, ...]:
    """Names of the materials that objects wear and that are clear; measured tables are not."""
    worn = {o.material for o in scene.objects} - set(scene.measured)
    return tuple(sorted(name for name in worn if is_clear(scene.materials[name], scene.textures.get(name))))
