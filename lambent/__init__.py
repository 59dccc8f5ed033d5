"""Lambent: real, measured materials where they will live."""

__version__ = "0.1.0"
