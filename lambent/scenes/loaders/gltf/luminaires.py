"""Luminaires of a glTF file (EXT_lights_ies): points that emit by an IES or EULUMDAT file, embedded or beside it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from lambent.core.ceilings import IES_BYTES
from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats, normalize
from lambent.core.light.photometry import radiometric
from lambent.core.plain import triple
from lambent.scenes.loaders.gltf.container import Gltf
from lambent.scenes.loaders.gltf.schema import Node, ProfileDocument
from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.photometry.files import parse_luminaire
from lambent.scenes.scene import IesLight


class Luminaires:
    """The profiles of a file, each read once; unusable ones are left out and reported to `note`."""

    def __init__(self, gltf: Gltf, note: Callable[[str], None]) -> None:
        self._gltf, self._note = gltf, note
        self._read: dict[int, Photometry | None] = {}

    def at(self, node: Node, world: Floats) -> IesLight | None:
        """The luminaire of a node with a transform.

        It is aimed along the node's -z; horizontal angle 0 is towards its x, 90 towards its y.
        """
        assert node.luminaire is not None
        photometry = self._profile(node.luminaire)
        if photometry is None:
            return None
        aim, across = -normalize(world[:3, 2]), normalize(world[:3, 0])
        tilt_deg = math.degrees(math.acos(min(max(-float(aim[1]), -1.0), 1.0)))
        tint = np.minimum(node.luminaire_color, 1.0) * node.luminaire_multiplier
        scale = triple(radiometric(tint * photometry.tilted(tilt_deg)))
        return IesLight(triple(world[:3, 3]), photometry, scale, triple(aim)).turned_to(across)

    def _profile(self, index: int) -> Photometry | None:
        if index not in self._read:
            profile = self._gltf.pick(self._gltf.document.profiles, index, "EXT_lights_ies.lights")
            field = f"EXT_lights_ies.lights.{index}"
            try:
                content = self._content(profile, field)
                self._read[index] = parse_luminaire(content, self._gltf.path, self._gltf.files).photometry()
            except UserError as error:
                self._read[index] = None
                why = f"{error.field}: {error.message}" if error.field and error.field != field else error.message
                self._note(f"{profile.name or field}: luminaire left out, {why}")
        return self._read[index]

    def _content(self, profile: ProfileDocument, field: str) -> bytes:
        if profile.uri is not None:
            if self._gltf.is_missing(profile.uri, field):
                raise UserError(f"{profile.uri} is missing", field=field)
            content = self._gltf.resource(profile.uri, field)
        elif profile.bufferView is not None:
            buffer, start, length, _ = self._gltf.view(profile.bufferView)
            content = buffer[start : start + length]
        else:
            raise UserError("it has neither a uri nor a buffer view", field=field)
        if len(content) > IES_BYTES:
            raise UserError(f"its file has {len(content)} bytes, more than {IES_BYTES}", field=field)
        return content
