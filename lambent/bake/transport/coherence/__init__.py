"""Visibility of distant lights from few shadow rays, by coherence between pixels and between lights."""
