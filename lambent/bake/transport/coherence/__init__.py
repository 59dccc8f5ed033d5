"""Visibility of distant lights with few shadow rays, by coherence between pixels and between lights."""
