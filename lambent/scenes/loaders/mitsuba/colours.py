"""Colours and spectra of Mitsuba's elements as linear RGB.

A reflected spectrum is seen under D65. An emitted one is converted as it is: a flat one is the equal-energy colour, not
white. Mitsuba 3 takes a single emitted number for a flat spectrum, version 0.6 for white.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lambent.core.ceilings import SPECTRUM_BYTES, WAVELENGTHS
from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats
from lambent.core.inputs import read_bytes
from lambent.core.light.colour import XYZ_TO_RGB, hex_colour, srgb_decode
from lambent.core.light.observer import black_body_xyz, observer
from lambent.scenes.loaders.mitsuba.document import Document, Element

Y_INTEGRAL_NM = 106.856895  # of the CIE 1931 luminosity function, as Mitsuba normalises emission


def colour_of(element: Element, document: Document, *, emitted: bool = False) -> Floats:
    """Linear RGB (3,) of a float, rgb, srgb, spectrum or blackbody element; not negative.

    Blackbodies are in W/(sr m^2 nm), weighted as by Mitsuba.
    """
    text = element.attributes.get("value", "").strip()
    if element.tag == "blackbody" or element.type == "blackbody":
        return _blackbody(element)
    if element.tag not in ("float", "rgb", "srgb", "spectrum", "integer", "color"):
        raise element.error("is no colour", expected="float, rgb, srgb or spectrum")
    if element.tag == "spectrum" and element.type:
        return _plugin(element, document, emitted)
    if text.startswith("#"):
        colour = hex_colour(text)
        if colour is None:
            raise element.error("not a colour", got=text, expected="#rrggbb")
        return np.array(colour)
    if ":" in text:
        return _spectrum(element, text, [pair.split(":") for pair in text.replace(",", " ").split()], emitted)
    if "filename" in element.attributes:
        return _file(element, document, emitted)
    values = element.floats()
    if len(values) not in (1, 3):
        raise element.error("wrong count of numbers", got=len(values), expected="1 or 3")
    rgb = np.maximum(np.array(values * 3 if len(values) == 1 else values), 0.0)
    if emitted and not document.is_old and element.tag == "spectrum" and len(values) == 1:
        rgb = rgb * XYZ_TO_RGB.sum(axis=1)
    return srgb_decode(rgb) if element.tag == "srgb" else rgb


def _plugin(element: Element, document: Document, emitted: bool) -> Floats:
    """A spectrum that is a plugin of version 3, its parameters below it."""
    inner = {child.name: child for child in element.children}

    def number(name: str, default: float) -> float:
        return inner[name].floats(1)[0] if name in inner else default

    def numbers(name: str) -> list[float]:
        return inner[name].floats() if name in inner else []

    if element.type in ("uniform", "d65"):
        tint = colour_of(inner["color"], document) if "color" in inner else np.ones(3)
        return np.maximum(number("scale", 1) * number("value", 1) * tint, 0)
    if element.type == "irregular":
        nm, values = numbers("wavelengths"), numbers("values")
    elif element.type == "regular":
        values = numbers("values")
        nm = np.linspace(number("wavelength_min", 360), number("wavelength_max", 830), len(values)).tolist()
    else:
        raise element.error(
            "unknown spectrum", got=element.type, expected="uniform, d65, regular, irregular or blackbody"
        )
    if len(nm) != len(values):
        raise element.error("not a spectrum", got=f"{len(nm)} wavelengths, {len(values)} values")
    return _spectrum(element, element.type, list(zip(nm, values, strict=True)), emitted)


def _file(element: Element, document: Document, emitted: bool) -> Floats:
    """A text file of a wavelength and a value a line."""
    written = element.attributes["filename"]
    path = document.files.path(written, element.file, f"line {element.line} <{element.tag}> filename")
    if not path.is_file():
        raise element.error(f"file not found: {written}")
    lines = read_bytes(path, SPECTRUM_BYTES).decode("utf-8", "replace").splitlines()
    rows = [line.replace(",", " ").split() for line in lines if line.strip() and not line.lstrip().startswith("#")]
    try:
        return _spectrum(element, written, [row[:2] for row in rows], emitted)
    except UserError as error:
        raise UserError(error.message, file=path, expected="a wavelength in nm and a value on each line") from error


def _spectrum(element: Element, text: str, pairs: Sequence[Sequence[str | float]], emitted: bool) -> Floats:
    from lambent.materials.measured.parts.spectral import rgb_of_spectra

    WAVELENGTHS.check(len(pairs), file=element.file, field=element.place)
    try:
        table = np.array([[float(v) for v in pair] for pair in pairs])
        nm, values = table.T
    except ValueError as error:
        raise element.error("not a spectrum", got=text, expected="wavelength:value pairs") from error
    if not np.isfinite(table).all() or (np.diff(nm) <= 0).any():
        raise element.error("not a spectrum", got=text, expected="finite values at increasing wavelengths")
    if not emitted:
        return np.asarray(np.maximum(rgb_of_spectra(nm) @ values, 0))
    radiance = np.interp(observer().wavelengths_nm, nm, values, left=0, right=0)
    return np.asarray(np.maximum(XYZ_TO_RGB @ (radiance @ observer().matching) / Y_INTEGRAL_NM, 0))


def _blackbody(element: Element) -> Floats:
    values = {child.name: child.attributes.get("value", "") for child in element.children} | element.attributes
    text = values.get("temperature", values.get("value", "")).strip().rstrip("kK")
    try:
        kelvin, scale = float(text), float(values.get("scale", 1))
    except ValueError as error:
        raise element.error("not a temperature", got=text) from error
    if not (100 <= kelvin <= 1e6 and 0 <= scale < 1e12):
        raise element.error("not a temperature", got=text, expected="100 to 1e6 K")
    return np.asarray(np.maximum(XYZ_TO_RGB @ black_body_xyz(kelvin) / Y_INTEGRAL_NM, 0) * scale)
