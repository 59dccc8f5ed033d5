"""LBNL BSDF XML on the Klems full basis: 145 x 145 patches, both sides, reflection and transmission.

Every pair of patches holds the mean of f over both, so that each patch receives the light the subject sends there.
Colour follows Radiance's tools: Visible is the luminance, beside CIE-X and CIE-Z.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from lambent.core.directions import Floats, direction
from lambent.core.errors import UserError
from lambent.core.files import write_text
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import BLACK, Lobe, Material
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.pairs import is_grey
from lambent.materials.export.patch_mean import patch_means
from lambent.materials.export.resampled import Scatterer, read_back, scatterer_of
from lambent.materials.measured.equal_energy import xyz_of_rgb
from lambent.materials.measured.klems import KLEMS_FULL

NAME = "LBNL BSDF XML"
ENDINGS = (".xml",)
TAKES: tuple[Kind, ...] = ("table", "material")

BASIS = KLEMS_FULL
_WIDTHS = (0.004, 0.02, 0.08, 0.3)  # of the lobes of the proposal for a table
_DIRECT_SHARE = 0.5
_EXACT = 1e-4  # share of the subject's size, below which it is a matrix of these patches itself
_ASKED_DEG = (1.0, 20.0, 45.0, 70.0)  # theta at which a table is tested for light from behind
_WAVELENGTHS = (("CIE-X", "X"), ("Visible", "Y"), ("CIE-Z", "Z"))
_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd]")


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write the file and return its losses.

    Raises
    ------
    UserError
        The subject scatters nothing; a file of zeros would be invalid.
    """
    scatterer = scatterer_of(subject)
    grey = scatterer.channels == 1 or (isinstance(subject, Material) and is_grey(subject))
    front, back = _means(subject, scatterer, progress)
    sides = (("Back", front), ("Front", back))  # the format's Back is our +z
    blocks = {f"{way} {side}": f[k] for k, way in enumerate(("Reflection", "Transmission")) for side, f in sides}
    lit = {name: values for name, values in blocks.items() if values.any()}
    if not lit:
        raise UserError("scatters no light, so there is nothing to write", file=scatterer.name)
    write_text(Path(path), _document(scatterer.name, lit, grey))
    cost = read_back(subject, Path(path), _lost(lit, grey))
    if max(cost.share.values()) < _EXACT:
        return cost
    return replace(cost, lost=(*_lost_detail(front), *cost.lost))


def _means(subject: Subject, scatterer: Scatterer, progress: Progress) -> tuple[Floats, Floats]:
    """Means of light from +z and from -z. A material is equal from both and reciprocal; so are its means, exactly."""
    if isinstance(subject, Material):
        means = patch_means(scatterer.eval, BASIS, MaterialBSDF(subject), 1, progress)
        means = np.stack([_reciprocal(f) for f in means])
        return means, means
    proposal = MaterialBSDF(_search(scatterer.transmits))
    front = patch_means(scatterer.eval, BASIS, proposal, 1, progress)
    from_behind = direction(np.radians(180 - np.array(_ASKED_DEG)), np.radians(_ASKED_DEG))
    if not subject.albedo(from_behind).any():
        return front, np.zeros_like(front)
    return front, patch_means(scatterer.eval, BASIS, proposal, -1, progress)


def _reciprocal(f: Floats) -> Floats:
    """The mean of f (outgoing, incident, C) and of f for reversed light.

    Reversed light enters by the patch opposite to the one the light left by.
    """
    back = BASIS.opposite
    return np.asarray((f + np.swapaxes(f, 0, 1)[back][:, back]) / 2)


def _search(transmits: bool) -> Material:
    """A proposal for tables: a material with lobes of every width a measured one can have."""
    white, part = (1.0, 1.0, 1.0), (1 / len(_WIDTHS),) * 3
    lobes = [Lobe(distribution="ggx", mx=m, my=m, r0=white, k=part) for m in _WIDTHS]
    if transmits:
        lobes += [lobe.model_copy(update={"side": "transmission", "r0": BLACK}) for lobe in lobes]
    quarter = (0.25, 0.25, 0.25)
    return Material(kd=quarter, kt_d=quarter if transmits else BLACK, lobes=tuple(lobes))


def _lost_detail(front: Floats) -> list[str]:
    lost = ["detail finer than a patch, 10 to 15 degrees wide: a patch holds its mean"]
    for name, values in zip(("reflected", "transmitted"), front, strict=True):
        share = BASIS.direct_share(values.sum(axis=-1))
        if share > _DIRECT_SHARE:
            lost.append(f"the shape of the highlight: {100 * share:.0f} % of the {name} light is in one patch")
    return lost


def _lost(lit: dict[str, Floats], grey: bool) -> tuple[str, ...]:
    lost = []
    if not grey:
        lost.append("colour in tools other than Radiance: they read Visible, the luminance, and not CIE-X and CIE-Z")
    if not any(name.endswith("Front") for name in lit):
        lost.append("light from behind is unknown: Radiance takes the back as black, transmission as mutual")
    return tuple(lost)


def _document(name: str, blocks: dict[str, Floats], grey: bool) -> str:
    data = []
    for part, values in blocks.items():
        xyz = np.repeat(values[..., :1], 3, axis=-1) if grey else xyz_of_rgb(values)
        for c, (wavelength, detector) in enumerate(_WAVELENGTHS):
            if wavelength == "Visible" or not grey:
                data.append(_block(wavelength, detector, part, xyz[..., c]))
    return _HEAD.format(name=escape(_NO_XML.sub(" ", name)), basis=_basis()) + "".join(data) + _TAIL


def _basis() -> str:
    rings = zip(BASIS.edges_deg[:-1], BASIS.edges_deg[1:], BASIS.n_phis, strict=True)
    return "".join(
        f"\t\t\t<AngleBasisBlock>\n\t\t\t\t<Theta>{0 if n == 1 else (lower + upper) / 2:g}</Theta>\n"
        f"\t\t\t\t<nPhis>{n}</nPhis>\n\t\t\t\t<ThetaBounds>\n\t\t\t\t\t<LowerTheta>{lower:g}</LowerTheta>\n"
        f"\t\t\t\t\t<UpperTheta>{upper:g}</UpperTheta>\n\t\t\t\t</ThetaBounds>\n\t\t\t</AngleBasisBlock>\n"
        for lower, upper, n in rings
    )


def _block(wavelength: str, detector: str, part: str, values: Floats) -> str:
    rows = "\n".join("\t".join(f"{v:.6e}" if v else "0" for v in row) for row in values.tolist())
    quantity = "BRDF" if part.startswith("Reflection") else "BTDF"
    return _BLOCK.format(
        wavelength=wavelength, detector=detector, direction=part, basis=BASIS.name, quantity=quantity, rows=rows
    )


_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<WindowElement xmlns="http://windows.lbl.gov" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:schemaLocation="http://windows.lbl.gov/BSDF-v1.4.xsd">
<WindowElementType>System</WindowElementType>
<FileType>BSDF</FileType>
<Optical>
<Layer>
\t<Material>
\t\t<Name>{name}</Name>
\t\t<Manufacturer>unknown</Manufacturer>
\t\t<DeviceType>Other</DeviceType>
\t</Material>
\t<DataDefinition>
\t\t<IncidentDataStructure>Columns</IncidentDataStructure>
\t\t<AngleBasis>
\t\t\t<AngleBasisName>LBNL/Klems Full</AngleBasisName>
{basis}\t\t</AngleBasis>
\t</DataDefinition>
"""
_BLOCK = """\t<WavelengthData>
\t\t<LayerNumber>System</LayerNumber>
\t\t<Wavelength unit="Integral">{wavelength}</Wavelength>
\t\t<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>
\t\t<DetectorSpectrum>ASTM E308 1931 {detector}.dsp</DetectorSpectrum>
\t\t<WavelengthDataBlock>
\t\t\t<WavelengthDataDirection>{direction}</WavelengthDataDirection>
\t\t\t<ColumnAngleBasis>{basis}</ColumnAngleBasis>
\t\t\t<RowAngleBasis>{basis}</RowAngleBasis>
\t\t\t<ScatteringDataType>{quantity}</ScatteringDataType>
\t\t\t<ScatteringData>
{rows}
\t\t\t</ScatteringData>
\t\t</WavelengthDataBlock>
\t</WavelengthData>
"""
_TAIL = "</Layer>\n</Optical>\n</WindowElement>\n"
