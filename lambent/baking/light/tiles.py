"""Stages of the light map, and the sampling of their tiles: in this process or, pickled, in another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from lambent.baking.light.sampling import Sampling, TexelJob, tile_samples
from lambent.baking.tracing import path_tracer
from lambent.baking.tracing.group_tally import Direct
from lambent.baking.tracing.lights.lit_texels import EVERY, LitTexels, SentLight
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats

GATHER_PASS = 64  # samples of a texel that are stratified together


@dataclass(frozen=True, eq=False)
class Stage:
    """How a `Sampling` of any process's scene is made.

    Attributes
    ----------
    samples, noise, max_depth, per_pass
        As of `Sampling`.
    lit : (Floats, Floats or None), optional
        Light maps (H, W, 3) of both sides where paths end, by group (n, H, W, 3) with `by_group`.
    diffuse : bool
        Whether the scene has diffuse terms; not with `lit`.
    by_group : bool
        Store the light of each light group.
    direct : Direct, optional
        Store direct light too.
    of_moments : bool
        Sample first moments of incident light (`path_tracer.moment`).
    sent : SentLight, optional
        What lit texels send, for further paths by way of these.
    """

    samples: tuple[int, int]
    noise: float
    max_depth: int
    per_pass: int
    lit: tuple[Floats, Floats | None] | None = None
    diffuse: bool = False
    by_group: bool = False
    direct: Direct | None = None
    of_moments: bool = False
    sent: SentLight | None = None

    def parts(self, traced: TracedScene) -> int:
        """Number of stored parts of the light."""
        direct = int(self.direct is not None)
        return len(traced.sorted_lights.groups) * (1 + direct) if self.by_group else direct

    def sampling(self, traced: TracedScene) -> Sampling:
        """The sampling of `traced.whole(diffuse=self.diffuse)`."""
        cache: Any = None
        tally: path_tracer.Tally | None = None
        if self.lit is not None:
            cache = (traced.grouped_cache if self.by_group else traced.cache)(*self.lit)
        if self.by_group:
            tally = traced.tally(diffuse=self.diffuse, direct=self.direct)
        elif self.direct is not None:
            tally = path_tracer.AllLight(direct=True)
        estimate = path_tracer.moment if self.of_moments else path_tracer.irradiance
        unseen = traced.unseen(diffuse=self.diffuse)
        how = self.samples, self.noise, self.max_depth, self.per_pass
        lit = None if self.sent is None or self.per_pass < EVERY else LitTexels(self.sent)
        return Sampling(*how, cache, estimate, unseen, tally, self.parts(traced), lit)


class TileSampler:
    """Raw samples of tiles (`tile_samples`)."""

    def __init__(self, traced: TracedScene, stage: Stage) -> None:
        self._traced, self._stage = traced, stage
        self._scene, self._how = traced.whole(diffuse=stage.diffuse), stage.sampling(traced)

    def __reduce__(self) -> tuple[Any, ...]:
        return TileSampler, (self._traced, self._stage)

    def __call__(self, job: TexelJob) -> Floats:
        return tile_samples(self._scene, job, self._how)


def path_traced(samples: tuple[int, int], noise: float, max_depth: int) -> Stage:
    """All bounces, in the whole scene; `max_depth` as in `path_tracer.radiance`."""
    return Stage(samples, noise, max_depth, min(32, max(1, samples[0] // 2)), diffuse=True)


def gathered(samples: int, noise: float, max_depth: int, lit: tuple[Floats, Floats | None]) -> Stage:
    """One diffuse bounce onto cached light, through any mirrors in between (final gathering, Reichert 1992)."""
    per_pass = max(1, min(GATHER_PASS, samples // 2))
    return Stage((2 * per_pass, samples), noise, max_depth, per_pass, lit)
