"""glTF 2.0, text and binary."""

from lambent.scenes.loaders.gltf.nodes import load

NAME, ENDINGS = "glTF 2.0", (".glb", ".gltf")

__all__ = ["ENDINGS", "NAME", "load"]
