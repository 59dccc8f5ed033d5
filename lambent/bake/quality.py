"""How much work a bake puts into each artefact."""

from __future__ import annotations

from dataclasses import dataclass

from lambent.core.errors import UserError, did_you_mean


@dataclass(frozen=True)
class Quality:
    """Sizes in texels per side, samples per texel, bounces.

    Light map tiles get path traced samples until their relative noise (root mean square, before denoising) is below
    `light_map_noise`, within the two bounds. Where `gather_samples` is not 0, that map is only what light meets at its
    first bounce: a second, final map gathers it with so many samples per texel, at a fraction of the noise, or with as
    many as bring a tile below `gather_noise`.
    Texels of probes get `probe_samples`, and up to sixteen times as many until their noise is below `probe_noise`.
    The light map is sampled and kept in tiles of `tile_texels` per side: what an interruption costs at most.
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
    gather_noise: float = 0.0
    probe_noise: float = 0.14
    tile_texels: int = 256


QUALITIES = {
    quality.name: quality
    for quality in (
        Quality("preview", 448, (32, 32), 0.30, 8, 256, 128, 16, gather_samples=128, photons_per_texel=64),
        Quality("normal", 1024, (64, 192), 0.15, 12, 512, 256, 16, 512, 512, gather_noise=0.04, probe_noise=0.1),
        Quality("final", 2048, (256, 8192), 0.015, 24, 1024, 256, 64, photons_per_texel=4096, probe_noise=0.05),
    )
}


def quality_named(name: str | Quality) -> Quality:
    """The quality of this name; a `Quality` is itself."""
    if isinstance(name, Quality):
        return name
    if name not in QUALITIES:
        raise UserError("unknown quality", got=name, expected=", ".join(QUALITIES), hint=did_you_mean(name, QUALITIES))
    return QUALITIES[name]
