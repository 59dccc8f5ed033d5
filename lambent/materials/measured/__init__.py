"""Measured materials: `load(path)` gives a `MeasuredTable` whatever the file format."""

from lambent.materials.measured.protocol import LeftOut, MeasuredSamples, MeasuredTable, TableInfo
from lambent.materials.measured.registry import load

__all__ = ["LeftOut", "MeasuredSamples", "MeasuredTable", "TableInfo", "load"]
