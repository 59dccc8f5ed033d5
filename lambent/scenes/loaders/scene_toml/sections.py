"""Base types of scene.toml sections: bounded numbers, directions. Unknown keys are errors."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from lambent.core.plain import Triple, triple
from lambent.core.views.camera import FARTHEST_M

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Near = Annotated[float, Field(ge=-FARTHEST_M, le=FARTHEST_M, allow_inf_nan=False)]
Vector = tuple[Finite, Finite, Finite]
Place = tuple[Near, Near, Near]
Colour = tuple[NotNegative, NotNegative, NotNegative]
Plane = tuple[Finite, Finite, Finite, Finite]


def not_zero(vector: Any) -> Any:
    if not any(vector):
        raise ValueError("a direction cannot be zero")
    return vector


def unit(vector: Triple) -> Triple:
    return triple(np.asarray(vector, float) / np.linalg.norm(vector))


class Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
