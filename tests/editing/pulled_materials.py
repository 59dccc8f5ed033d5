"""Materials with a pulled node."""

from __future__ import annotations

from lambent.editing.curves.nodes import Which, pulled, values_of, with_values
from lambent.materials.document import Material


def with_node(material: Material, which: Which, node: int, factor: float) -> Material:
    """The material with one node of a curve times a factor, in all channels."""
    values = values_of(material, which)
    channels = tuple(range(values.shape[1]))
    return with_values(material, which, pulled(values, node, factor * float(values[node].max()), channels, soft=False))
