"""Lights of a scene.toml, in radiometric or photometric units: W/sr, cd, lm; W/m^2, lx; IES and EULUMDAT files.

A photometric light is white, or has a `colour`, whose luminance has no effect.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator, model_validator

from lambent.core.light.colour import luminance
from lambent.core.light.photometry import LM_PER_W
from lambent.core.plain import Triple, triple
from lambent.scenes.loaders.scene_toml.sections import Colour, Finite, NotNegative, Section, Vector, not_zero, unit
from lambent.scenes.photometry.luminaire import Luminaire
from lambent.scenes.photometry.opening import POINT
from lambent.scenes.scene import DirectionalLight, IesLight, PointLight

WHITE: Triple = (1.0, 1.0, 1.0)


def one_of(section: Section, *names: str, needed: bool = True) -> None:
    """Raise `ValueError` if a section has more than one of these keys, or none although one is `needed`."""
    given = [name for name in names if getattr(section, name) is not None]
    if len(given) > 1:
        raise ValueError(f"has two intensities, {given[0]} and {given[1]}")
    if needed and not given:
        raise ValueError(f"has no intensity: set one of {', '.join(names)}")


def coloured(value: float, colour: Colour | None) -> Triple:
    """W/sr, W/m^2 or W/(sr m^2) of cd, lx or cd/m^2."""
    tint = np.array(colour or WHITE, float)
    return triple(tint * (value / LM_PER_W / max(float(luminance(tint)), 1e-9)))


class _Coloured(Section):
    name: str = ""
    colour: Colour | None = None

    @field_validator("colour")
    @classmethod
    def _not_black(cls, colour: Colour | None) -> Colour | None:
        if colour is not None and not any(colour):
            raise ValueError("a colour cannot be black")
        return colour


class _Lamp(_Coloured):
    """A small lamp whose light is given in one of three units."""

    position: Vector
    intensity: Colour | None = None
    candela: NotNegative | None = None
    lumens: NotNegative | None = None

    @model_validator(mode="after")
    def _said_once(self) -> _Lamp:
        one_of(self, "intensity", "candela", "lumens")
        return self

    def intensity_of(self, solid_angle_sr: float) -> Triple:
        """W/sr; lumens are distributed over `solid_angle_sr`."""
        if self.intensity is not None:
            return self.intensity
        candela = self.candela if self.candela is not None else (self.lumens or 0.0) / max(solid_angle_sr, 1e-9)
        return coloured(candela, self.colour)


class PointSection(_Lamp):
    """W/sr, cd, or lm in all directions."""

    kind: Literal["point"]

    def light(self) -> PointLight:
        return PointLight(self.position, self.intensity_of(4 * math.pi), name=self.name)


class SpotSection(_Lamp):
    """W/sr or cd at its centre, or lm in its cone."""

    kind: Literal["spot"]
    direction: Vector
    inner_deg: Annotated[float, Field(ge=0, le=90)] = 0.0
    outer_deg: Annotated[float, Field(gt=0, le=90)] = 45.0

    _direction = field_validator("direction")(not_zero)

    @model_validator(mode="after")
    def _cone(self) -> SpotSection:
        if self.inner_deg > self.outer_deg:
            raise ValueError("inner_deg is larger than outer_deg")
        return self

    def light(self) -> PointLight:
        inner, outer = math.radians(self.inner_deg), math.radians(self.outer_deg)
        edge = (math.sin(outer) - math.sin(inner)) / (outer - inner) if outer > inner else math.cos(outer)
        intensity = self.intensity_of(2 * math.pi * (1 - edge))  # falls linearly with the angle from inner to outer
        return PointLight(
            self.position, intensity, unit(self.direction), self.inner_deg, self.outer_deg, name=self.name
        )


class DirectionalSection(_Coloured):
    """W/m^2 or lx on a surface that faces it."""

    kind: Literal["directional"]
    direction: Vector
    irradiance: Colour | None = None
    lux: NotNegative | None = None

    _direction = field_validator("direction")(not_zero)

    @model_validator(mode="after")
    def _light(self) -> DirectionalSection:
        one_of(self, "irradiance", "lux")
        return self

    def light(self) -> DirectionalLight:
        irradiance = self.irradiance if self.irradiance is not None else coloured(self.lux or 0.0, self.colour)
        return DirectionalLight(unit(self.direction), irradiance, self.name)


class IesSection(_Coloured):
    """A luminaire of an IES or EULUMDAT file, straight down unless aimed; `lumens` scales it to that flux.

    `scale` is a factor on its light, `across` the direction of horizontal angle 0, instead of `rotation_deg`. Its light
    leaves the `opening` that the file describes, or a point.
    """

    kind: Literal["ies"]
    file: str
    lamp_set: int = 0
    position: Vector
    direction: Vector = (0.0, -1.0, 0.0)
    rotation_deg: Finite = 0.0
    across: Vector | None = None
    lumens: NotNegative | None = None
    scale: NotNegative = 1.0
    opening: Literal["point", "file"] = "file"

    _direction = field_validator("direction")(not_zero)
    _across = field_validator("across")(lambda across: across if across is None else not_zero(across))

    def light_of(self, luminaire: Luminaire) -> IesLight:
        photometry = luminaire.photometry(self.lamp_set) if self.lumens is None else luminaire.values
        if self.opening == "point":
            photometry = replace(photometry, opening=POINT)
        aim = unit(self.direction)
        tilt_deg = math.degrees(math.acos(min(max(-aim[1], -1.0), 1.0)))
        scale = photometry.tilted(tilt_deg)
        if self.lumens is not None:
            scale = self.lumens / max(photometry.lumens, 1e-9)
        power = coloured(scale * self.scale, self.colour)
        light = IesLight(self.position, photometry, power, aim, self.rotation_deg, name=self.name)
        return light if self.across is None else light.turned_to(np.array(unit(self.across)))


LightSection = PointSection | SpotSection | DirectionalSection | IesSection
