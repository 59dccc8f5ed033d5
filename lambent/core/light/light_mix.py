"""Light mix: brightness and colour of each light group, relative to the baked light.

Light adds up, so the picture of any mix is exact: E = sum over groups g of s_g E_g, with a factor s_g per channel.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from lambent.core.errors import UserError, did_you_mean
from lambent.core.light.colour import XYZ_TO_RGB, hex_colour, hex_of, luminance, rgb_to_xyz
from lambent.core.light.observer import black_body_xyz
from lambent.core.plain import Triple, triple

WHITE: Triple = (1.0, 1.0, 1.0)
LEAST_K, MOST_K = 1667.0, 25000.0  # of lamps and skies
MOST_INTENSITY = 1000.0
MOST_DUV = 0.05  # in CIE 1960 (u, v)
EXPECTED = "NAME=VALUE, with VALUE an intensity, off, 2700K, #rrggbb, or several joined by commas"
Factors = Mapping[str, Triple]  # by group; groups left out stay as baked


@dataclass(frozen=True)
class GroupMix:
    """One group's mix: `intensity` and a tint of luminance 1 multiply its light.

    The tint is the colour of a black body at `temperature_k`, LEAST_K to MOST_K, times the linear `colour`, whose
    luminance has no effect. White light takes the tint's colour; coloured light is tinted as by a filter.
    """

    on: bool = True
    intensity: float = 1.0
    temperature_k: float | None = None
    colour: Triple = WHITE

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012 - read by pydantic: an unknown key in a file is an error

    def __post_init__(self) -> None:
        if not 0 <= self.intensity <= MOST_INTENSITY:
            expected = f"0 to {MOST_INTENSITY:g}"
            raise UserError("intensity is out of range", field="light", got=self.intensity, expected=expected)
        if self.temperature_k is not None and not LEAST_K <= self.temperature_k <= MOST_K:
            expected = f"{LEAST_K:g} to {MOST_K:g} K"
            raise UserError("temperature is out of range", field="light", got=self.temperature_k, expected=expected)
        if not (all(0 <= value <= 1e6 for value in self.colour) and any(self.colour)):
            raise UserError(
                "light colour is out of range", field="light", got=self.colour, expected="0 to 1e6, not black"
            )

    @property
    def tint(self) -> np.ndarray:
        """Colour (3,) of white light in this mix, of any luminance."""
        tint = np.array(self.colour, float)
        return tint if self.temperature_k is None else tint * black_body(self.temperature_k)

    @property
    def factor(self) -> Triple:
        """Factor on the group's light per channel, (3,)."""
        if not self.on:
            return 0.0, 0.0, 0.0
        tint = self.tint
        if (level := float(luminance(tint))) <= 0:  # a blue filter on candle light
            return 0.0, 0.0, 0.0
        return triple(tint * (self.intensity / level))


AS_BAKED = GroupMix()


@dataclass(frozen=True)
class LightMix:
    """Mixes of groups by name; other groups stay as baked."""

    groups: Mapping[str, GroupMix] = field(default_factory=dict)

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012

    def of(self, name: str) -> GroupMix:
        return self.groups.get(name, AS_BAKED)

    def changed(self, name: str, mix: GroupMix) -> LightMix:
        """A copy with a new mix for one group."""
        others = {key: value for key, value in self.groups.items() if key != name}
        return LightMix(others if mix == AS_BAKED else {**others, name: mix})

    @property
    def factors(self) -> dict[str, Triple]:
        """Factors of the groups that differ from the bake."""
        found = {name: mix.factor for name, mix in self.groups.items()}
        return {name: factor for name, factor in found.items() if factor != WHITE}


@dataclass(frozen=True)
class MixTrack:
    """Mixes over time: for each group name, keys of increasing time in seconds and mix.

    A group's factor is linear between keys, and constant before the first and after the last.
    """

    groups: Mapping[str, tuple[tuple[float, GroupMix], ...]] = field(default_factory=dict)

    __pydantic_config__ = {"extra": "forbid"}  # noqa: RUF012

    def __post_init__(self) -> None:
        for name, keys in self.groups.items():
            if not keys or any(b[0] <= a[0] for a, b in pairwise(keys)):
                raise UserError("times do not increase", field=name, got=[time_s for time_s, _ in keys])

    @classmethod
    def of(cls, mix: LightMix) -> MixTrack:
        """A track that holds one mix at all times."""
        return cls({name: ((0.0, one),) for name, one in mix.groups.items()})

    def factors_at(self, time_s: float) -> dict[str, Triple]:
        """Factors at a time, of the groups that differ from the bake."""
        found = {}
        for name, keys in self.groups.items():
            times, factors = [key[0] for key in keys], np.array([mix.factor for _, mix in keys])
            found[name] = triple(np.interp(time_s, times, channel) for channel in factors.T)
        return {name: factor for name, factor in found.items() if factor != WHITE}


def factors_of(names: Sequence[str], light: Factors) -> np.ndarray:
    """Factors (n, 3) float32 of the groups of these names in a mix; `UserError` for an unknown group."""
    for name in light:
        if name not in names:
            hint, expected = did_you_mean(name, names), ", ".join(names)
            raise UserError("unknown light group", field="light", got=name, expected=expected, hint=hint)
    return np.array([light.get(name, WHITE) for name in names], np.float32)


def black_body(temperature_k: np.ndarray | float) -> np.ndarray:
    """Linear RGB (..., 3), luminance 1, of black bodies at LEAST_K to MOST_K; no channel is negative."""
    rgb = np.maximum(black_body_xyz(temperature_k) @ XYZ_TO_RGB.T, 0)
    return np.asarray(rgb / luminance(rgb)[..., None])


def nearest_temperature_k(rgb: np.ndarray) -> float | None:
    """Correlated colour temperature of a linear colour (3,), to 1 %, within LEAST_K to MOST_K.

    None where the distance from the Planckian locus exceeds MOST_DUV, beyond which CIE 15:2004 gives no temperature.
    """
    if not luminance(rgb) > 0:
        return None
    kelvin = np.geomspace(LEAST_K, MOST_K, 600)
    off = np.linalg.norm(_uv(black_body(kelvin)) - _uv(np.asarray(rgb)), axis=1)
    return float(kelvin[np.argmin(off)]) if off.min() <= MOST_DUV else None


def _uv(rgb: np.ndarray) -> np.ndarray:
    """CIE 1960 chromaticity (..., 2) of linear colours (..., 3)."""
    xyz = rgb_to_xyz(rgb)
    return np.asarray(xyz[..., :2] * (4, 6) / (xyz @ (1, 15, 3))[..., None])


def parse_light(texts: Iterable[str]) -> MixTrack:
    """Parse a track from texts such as "lamp=off", "lamp=0.3", "lamp=2700K", "lamp=0.5,#ffd0a0" and "lamp=0.5@4".

    The number after @ is a time in seconds, 0 by default. Values are interpolated between times.

    Raises
    ------
    UserError
        If a text is malformed, a value is out of range, or a group has two mixes at one time.
    """
    said: dict[str, dict[float, GroupMix]] = {}
    for text in texts:
        name, _, value = text.rpartition("=")
        name, (value, _, at) = name.strip(), value.partition("@")
        time_s = _number(at, text) if at else 0.0
        if not name or not value:
            raise UserError("is no light setting", field="--light", got=text, expected=EXPECTED)
        of_name = said.setdefault(name, {})
        if time_s in of_name:
            raise UserError("names a light twice", field="--light", got=text, hint="join its values with a comma")
        of_name[time_s] = mix_of(value, text)
    return MixTrack({name: tuple(sorted(keys.items(), key=lambda key: key[0])) for name, keys in said.items()})


def mix_of(value: str, text: str) -> GroupMix:
    """Parse the mix of a value such as "0.5,2700K"; raises `UserError` that quotes `text`, the whole argument."""
    try:
        return _mix_of(value, text)
    except UserError as error:
        if error.field != "light":
            raise
        ranges = f"intensities reach {MOST_INTENSITY:g}; a temperature ends in K, {LEAST_K:g}K to {MOST_K:g}K"
        raise UserError(error.message, field="--light", got=text, hint=ranges) from error


def in_words(mix: GroupMix) -> str:
    """The value that `mix_of` reads as this mix; a colour keeps 8 bits."""
    words = [f"{mix.intensity:g}"] if mix.on else [f"{mix.intensity:g}", "off"]
    if mix.temperature_k is not None:
        words.append(f"{mix.temperature_k:g}K")
    if mix.colour != WHITE:
        words.append(hex_of(np.array(mix.colour) / max(mix.colour)))
    return ",".join(words)


def _mix_of(value: str, text: str) -> GroupMix:
    mix, said = AS_BAKED, set[str]()
    for word in (part.strip() for part in value.split(",")):
        if word.lower() in ("on", "off"):
            kind, mix = "on", replace(mix, on=word.lower() == "on")
        elif (colour := hex_colour(word)) is not None:
            if not any(colour):
                raise UserError("light colour cannot be black", field="--light", got=text, hint="use off")
            kind, mix = "colour", replace(mix, colour=colour)
        elif re.fullmatch(r"[\d.]+[kK]", word):
            kind, mix = "temperature", replace(mix, temperature_k=_number(word[:-1], text))
        else:
            kind, mix = "intensity", replace(mix, intensity=_number(word, text))
        if kind in said:
            raise UserError(f"has two values for {kind}", field="--light", got=text)
        said.add(kind)
    return mix


def _number(word: str, text: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = -1.0
    if not 0 <= value < 1e9:
        raise UserError("is no light setting", field="--light", got=text, expected=EXPECTED)
    return value
