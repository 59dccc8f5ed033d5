"""Clear glass materials of a scene, through which the sun passes undeviated."""

from __future__ import annotations

from lambent.materials.clear import clear_terms
from lambent.materials.document import Material
from lambent.scenes.scene import MaterialTextures, Scene


def is_clear(material: Material, textures: MaterialTextures | None) -> bool:
    """Whether a surface transmits light undeviated, by `materials.clear`, without textures that spread it."""
    even = textures is None or (textures.roughness is None and textures.normal is None)
    return even and clear_terms(material) is not None


def panes_of(scene: Scene) -> tuple[str, ...]:
    """Names of the clear materials that objects use; measured tables are excluded."""
    used = {o.material for o in scene.objects} - set(scene.measured)
    return tuple(sorted(name for name in used if is_clear(scene.materials[name], scene.textures.get(name))))
