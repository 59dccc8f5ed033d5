"""Reciprocity: f(wi, wo) = f(wo, wi)."""

from __future__ import annotations

from lambent.materials.checking.check import RECIPROCITY_LIMIT, Scatters, reciprocity_error


def assert_reciprocal(bsdf: Scatters, *, limit: float = RECIPROCITY_LIMIT, seed: int = 0) -> None:
    """Fail where swapping the directions changes f."""
    error = reciprocity_error(bsdf, seed)
    assert error <= limit, f"swapping wi and wo changes f by up to {error:.2g} of its value"
