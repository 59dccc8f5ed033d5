"""What each reader refuses, and the line that says why."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.errors import UserError
from tests.materials.measured.measured_files import (
    Loaded,
    cornell_rows,
    cornell_text,
    ddr,
    lighttools,
    merl_bytes,
    rgl_fields,
    tensor_bytes,
    zemax_text,
)

CORNELL = cornell_text(cornell_rows(), np.linspace(400, 700, 5))
ZEMAX = zemax_text(lambda wi, wo: 0.1 + 0 * wo[..., :1], "PlaneSymmetrical")
MERL = merl_bytes(np.full((90, 90, 180, 3), 0.1))
ROWS = "0 0 0 0 1\n0 0 20 0 1\n0 0 20 90 1\n"
NAMES, OWN = "theta_in phi_in theta_out phi_out", "theta_i phi_i theta_o phi_o"
RUSIN, F = "#PARAM_IN RUSIN_TH_TD_PD\n", "#PARAM_OUT INV_STERADIAN\n"
DSF, FRED = "#incident_angle 30 0\n#format: theta phi DSF\n", "type bsdf_data\nformat angles=deg bsdf=value scale=1\n"


def but(text: str, old: str, new: str = "") -> str:
    """A sound text with its first `old` replaced."""
    assert old in text
    return text.replace(old, new, 1)


def tensors(**change: np.ndarray) -> bytes:
    return tensor_bytes(rgl_fields(np.zeros(1)) | {name: array.astype(np.float32) for name, array in change.items()})


REFUSED: dict[str, list[tuple[str | bytes, str]]] = {
    "columns": [
        (ROWS, "is columns without names.*theta_i phi_i theta_o phi_o, then f"),
        (f"{NAMES} value\n{ROWS}", "quantity of the value columns is not stated; found value"),
        (f"{NAMES} r g b\n0 0 0 0 1 1 1\n", "quantity of the value columns is not stated"),
        (f"{NAMES} a b\n0 0 0 0 1 1\n", "unknown value columns"),
        (f"{NAMES} brdf\n", "no rows"),
        (f"{NAMES} brdf\n0 0 0 0 1\n0 0 0\n", "one value per column name"),
        ("theta_in;phi_in;theta_out;phi_out;brdf\n0,5;0;0;0;0.25\n", "decimal commas"),
        ("0,5;0,0;0,0;0,0;0,25\n0,5;0,0;9,0;0,0;0,25\n", "columns without names"),
        ("theta_in theta_inc theta_out brdf\n0 0 0 1\n", "same angle"),
        (f"{NAMES} brdf\n99 0 0 0 1\n", "outside its range"),
        (f"{NAMES} brdf\n0 0 0 0 nan\n", "no measured value"),
        (f"{NAMES} brdf\n0 0 0 0 1\n0 0 1.2 3.1 1\n", r"seem to be radians.*add \(rad\)"),
        (f"{OWN} p\n0 0 200 0 1\n", "outside its range"),
        (f"{OWN} p\n0 0 0 0 -3\n", "no measured value"),
        (f"{OWN} p\n0 0 0 0 1\n20 40 0 0 1\n", "do not form a grid"),
        (f"# symmetry: isotropc\n{OWN} p\n0 0 0 0 1\n", "did you mean 'isotropic'"),
        (f"# symmetry: quadrant\n{OWN} p\n0 0 0 0 1\n0 100 0 0 1\n", "more than the symmetry"),
        ("NUM_POINTS 5\nVARS theta_i,phi_i,theta_s,phi_s,BRDF\n0,0,0,0,1\n", "NUM_POINTS: wrong number of tuples"),
        ("VARS theta_i,phi_i,theta_s,phi_s\n0,0,0,0\n", "unknown value columns; found none"),
        (f"{NAMES} brdf\n{ROWS}".encode("utf-16"), r"is UTF-16.*save it again as UTF-8"),
    ],
    "ALTA": [
        ("#DIM 1 3\n#PARAM_IN COS_TH\n#PARAM_OUT RGB_COLOR\n0.9 .1 .2 .3\n", "slice.*COS_TH.*half vector alone"),
        (f"#DIM 1 1\n#PARAM_IN COS_TLR\n{F}0.9 .1\n", "slice.*mirrored view alone"),
        ("#DIM 1 1\n0.5 2.5\n", "curve over one variable"),
        ("#PARAM_IN UNKNOWN_PARAMETRIZATION \n#DIM 1 1 \n#VS 2 \n 0.1 1 .5 1.5\n", "curve over one variable"),
        ("#ALTA FUNC HEADER\n#DIM 3 3\n#PARAM_IN COS_TH\n#ALTA HEADER END\n\n#FUNC lafortune\n1 2\n", "fitted by ALTA"),
        ("#DIM 3 1\n#PARAM_OUT RGB_COLOR\n0 0 0 1\n", "PARAM_IN: is unknown; found nothing.*STARK_3D"),
        ("#DIM 3 1\n#PARAM_IN RUSIN_TH_TP_PD\n#PARAM_OUT RGB_COLOR\n0 0 0 1\n", "did you mean 'RUSIN_TH_TD_PD'"),
        (f"#DIM 4 1\n{RUSIN}{F}0 0 0 0 1\n", "#DIM: .*expected 3 for"),
        (f"#DIM 3 1\n{RUSIN}0 0 0 1\n", "PARAM_OUT: quantity.*is not stated.*INV_STERADIAN"),
        (f"#DIM 3 7\n{RUSIN}{F}" + "0 " * 10, "wavelengths"),
        (f"#DIM 3 1\n{RUSIN}{F}0 0 0 1 2\n", "wrong number of columns"),
        (f"#DIM 3 1\n{RUSIN}{F}30 20 90 1\n", "more than a turn.*radians"),
        (f"#DIM 3 1\n{RUSIN}{F}1.5 1.5 3 1\n", "above the horizon"),
    ],
    "Cornell": [
        (CORNELL[:-12], "one value per column name"),
        (but(CORNELL, "0.2", "spam"), "not a number"),
        (but(CORNELL, "0.2", "0.2.1"), "not a number; found 0.2.1"),
        (but(CORNELL, " 0.2", " - 0.2"), "not a number; found -"),
        (but(CORNELL, "\n5\n", "\n500\n"), "one value per column name"),
        ("\n".join(CORNELL.split("\n")[:3]), "has no rows"),
        (CORNELL.replace(" 0.2 0.2 0.2 0.2 0.2", " -1 nan -1 -1 -1"), "no measured value"),
    ],
    "Integra": [
        (but(ddr(), "Luminance Absolute", "Radiance"), "TypeData: quantity.*is not stated; found radiance"),
        (but(ddr(), "TypeColorModel BW", "TypeColorModel RGB"), "channels do not match.*found bw"),
        (but(ddr(), "theta 9", "theta 8"), "theta: count differs"),
        (but(ddr(), "sigma 4\n 0 30 60 90", "sigma 4\n 0 30 60 91"), "sigma: is not a list of angles"),
        (but(ddr(), " kbdf\n  0.8", " kbdf\n "), "bw kbdf: wrong number of values; found 3; expected 1 x 4"),
        (but(ddr(), " enddef", " 1 enddef"), "bw def: wrong number of values"),
        (but(ddr(), " def", " 1,5 def"), "not a number; found 1,5"),
        (but(ddr(), "phi 8", "psi 8"), "is missing|is not a list"),
        (ddr(kind="Luminance Relative", kbdf=None), "kbdf: is relative"),
        ("Source Measured\nTypeColorModel BW\nsigma 3\n 0 30 60\nbw\n def\n 0.04 0.05 0.09\n enddef\n",
         "specular reflectance.*load the diffuse distribution"),
    ],
    "LightTools": [
        (lighttools(poi=(0, 45)), "several planes of incidence"),
        (but(lighttools(), "Side Front", "Side Top"), "block 1: unknown Side; found Top"),
        (but(lighttools(), "ScatterRadial 6", "ScatterRadial 5"), "ScatterRadial: count differs"),
        (but(lighttools(), "TIS 0.3\n", "TIS 0.3\n1 "), "block 1: wrong number of values"),
        (but(lighttools(), "TIS 0.3"), "is missing|wrong number of blocks"),
        (lighttools(xyz=True), "TristimulusValue: is missing"),
        (but(lighttools(), "Wavelength 550", "Wavelength 450"), "channels are missing"),
        (but(lighttools(), "AOI 30", "AOI 95"), "outside its range"),
    ],
    "pab-opto": [
        ("#incident_angle 30 0\n#format: theta phi intensity\n0 0 1\n", "format is unknown; found theta phi intensity"),
        ("#intheta 30\n#format: theta phi DSF\n0 0 1\n", "inphi is not an angle; found nothing"),
        ("#intheta inf\n#incident_angle 3 0\n#inphi 0\n#format: theta phi DSF\n0 0 1\n", "intheta is not an angle"),
        (f"{DSF}0 0 1 2\n", "rows do not match"),
        (f"{DSF}#colorimetry: CIE-XYZ\n0 0 1\n", "5 per row"),
        (f"{DSF}#colorimetry: RGB\n0 0 1\n", "colorimetry is unknown"),
        (f"{DSF}0 0 1\n#incident_angle 150 0\n#format: theta phi DSF\n0 0 1\n", "both sides"),
        (f"{DSF}0 0 1\n#incident_angle 40 0\n#format: theta phi BSDF\n0 0 1\n", "different formats"),
    ],
    "Zemax": [
        (ZEMAX.replace("PlaneSymmetrical", "PlanSymmetrical"), "did you mean 'PlaneSymmetrical'"),
        (but(ZEMAX, "ScatterType\tBRDF"), "ScatterType: unknown ScatterType"),
        (but(ZEMAX, "ScatterRadial", "Scatterradius"), "ScatterRadial: is missing"),
        (but(ZEMAX, "AngleOfIncidence\t3", "AngleOfIncidence\t4"), "count differs"),
        (but(ZEMAX, "10\t40\t70", "40\t10\t70"), "not a list of angles"),
        (ZEMAX.replace("DataBegin", ""), "has no DataBegin"),
        (but(ZEMAX, "TIS"), "wrong number of data blocks"),
        (ZEMAX[:-200], "wrong number of values"),
        (but(ZEMAX, "Monochrome\nSca", "XYZ\nSca"), "data sections"),
        (ZEMAX[: ZEMAX.index("TIS")] + "TIS 0\n" + "0 " * 133 + "TIS 0\n" + "0 " * 266, "wrong number of data blocks"),
    ],
    "FRED": [
        ("type bsdf_data\n10 0\n0 0 1\n", "second line must give the format"),
        (f"{but(FRED, 'deg', 'rad')}10 0\n0 0 1\n", "angles: is unknown"),
        (f"{but(FRED, 'scale=1', 'scale=-1')}10 0\n0 0 1\n", "scale: is not a positive"),
        (FRED, "no block"),
        (f"{FRED}0 0 1\n", "no block"),
        (f"{FRED}10 0\n0 0 1 2\n", "4 numbers in line 4"),
        (f"{but(FRED, 'deg', 'sin')}0 0\n2 0 1\n", "direction cosines exceed 1"),
    ],
    "MERL": [
        (MERL[:-8], "size does not match"),
        (MERL[:5000], "size does not match"),
        (np.array([90, 90, 180], ">i4").tobytes() + bytes(100), "big-endian"),
        (merl_bytes(np.full((4, 4, 4, 3), np.nan)), "no measured value"),
        (np.array([4, 4, 4], "<i4").tobytes() + np.full(192, np.nan).tobytes(), "no measured value"),
        (merl_bytes(np.full((6, 6, 12, 3), 1e30)), "no measured value.*beyond 1e"),
    ],
    "RGL": [
        (tensors(vndf=np.zeros((1, 4, 9, 12))), "zero for an incident"),
        (tensors(vndf=np.full((1, 4, 9, 12), np.nan)), "not finite"),
        (tensors(vndf=np.ones((1, 3, 9, 12))), "does not fit"),
        (tensors(rgb=np.full((1, 4, 3, 6, 6), np.nan)), "no measured value"),
        (tensors(rgb=-np.ones((1, 4, 3, 6, 6))), "no measured value"),
        (tensors(rgb=np.ones((1, 4, 2, 6, 6))), "three channels"),
        (tensors(theta_i=np.array([0, 1, 0.5, 1.5])), "increasing"),
        (tensors(theta_i=np.zeros((4, 1))), "shape or type"),
        (tensors(sigma=np.zeros((3, 8))), "sigma: is zero"),
        (tensors(ndf=np.zeros((1, 8))), "too small"),
    ],
}  # fmt: skip


@pytest.mark.parametrize(
    ("content", "said"),
    [pytest.param(*case, id=f"{name}: {case[1]}") for name, cases in REFUSED.items() for case in cases],
)
def test_refusals_say_what_is_wrong(loaded: Loaded, content: str | bytes, said: str) -> None:
    with pytest.raises(UserError, match=said):
        loaded(content)
