"""Numbers within an element's attributes."""

from __future__ import annotations

import numpy as np

from lambent.core.directions import Floats
from lambent.scenes.loaders.mitsuba.document import Element

ABSURD = 1e30


def floats_of(element: Element, count: int | None = None, attribute: str = "value") -> list[float]:
    """Finite numbers of an attribute, separated by blanks or commas."""
    text = element.attributes.get(attribute, "")
    try:
        values = [float(word) for word in text.replace(",", " ").split()]
    except ValueError as error:
        raise element.error("not a number", got=text) from error
    if not all(abs(v) < ABSURD for v in values):
        raise element.error("not a finite number", got=text)
    if count is not None and len(values) != count:
        raise element.error("wrong count of numbers", got=text or "nothing", expected=count)
    return values


def triple_of(element: Element, default: float = 0.0) -> Floats:
    """(3,) of x, y, z or of a value; one number counts for all three."""
    if "value" in element.attributes:
        values = floats_of(element)
        if len(values) not in (1, 3):
            raise element.error("wrong count of numbers", got=len(values), expected="1 or 3")
        return np.array(values * 3 if len(values) == 1 else values)
    return np.array([floats_of(element, 1, c)[0] if c in element.attributes else default for c in "xyz"])
