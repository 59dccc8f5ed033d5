"""How much work a bake puts into each artefact."""

from __future__ import annotations

from dataclasses import dataclass

from lambent.core.errors import UserError, did_you_mean


@dataclass(frozen=True)
class Quality:
    """Sizes in texels per side, samples per texel, bounces.

    Light map tiles get path traced samples until their relative noise (root mean square, before denoising) is below
    `light_map_noise`, within the two bounds. Where `gather_samples` is not 0, that map is only what light meets at its
    first bounce: a second, final map gathers it with so many samples per texel, at a fraction of the noise.
    A light map of photons takes `photons_per_texel`, on average over the map, and no final gathering.
    """

    name: str
    light_map_texels: int
    light_map_samples: tuple[int, int]
    light_map_noise: float
    max_depth: int
    environment_texels: int
    probe_texels: int
    probe_samples: int
    gather_samples: int = 0
    photons_per_texel: int = 64


QUALITIES = {
    quality.name: quality
    for quality in (
        Quality("preview", 448, (32, 32), 0.30, 8, 256, 128, 16, gather_samples=128, photons_per_texel=64),
        Quality("normal", 1024, (128, 256), 0.04, 12, 512, 256, 64, gather_samples=512, photons_per_texel=512),
        Quality("final", 2048, (256, 8192), 0.015, 24, 1024, 256, 512, photons_per_texel=4096),
    )
}


def quality_named(name: str | Quality) -> Quality:
    """The quality of this name; a `Quality` is itself."""
    if isinstance(name, Quality):
        return name
    if name not in QUALITIES:
        raise UserError("unknown quality", got=name, expected=", ".join(QUALITIES), hint=did_you_mean(name, QUALITIES))
    return QUALITIES[name]
