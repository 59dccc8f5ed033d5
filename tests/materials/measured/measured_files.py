"""Small files of every format, made from functions whose answer is known."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np

from lambent.core.geometry.directions import direction
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.parts.tensor_file import tensor_bytes as tensor_bytes
from lambent.materials.measured.protocol import MeasuredTable

Loaded = Callable[..., MeasuredTable]
"""The fixture `loaded`."""


def rgl_fields(phi_i: np.ndarray, seed: int = 0) -> dict[str, np.ndarray]:
    """Tensors of a made-up material that varies in every parameter; sigma of an isotropic one is constant in phi."""
    random = np.random.default_rng(seed)
    theta_i = np.array([0.0, 0.5, 1.0, np.pi / 2], dtype=np.float32)
    incident = (len(phi_i), len(theta_i))
    sigma = random.uniform(0.5, 1, (3, 8)).astype(np.float32)
    return {
        "description": np.frombuffer(b"made up", dtype=np.uint8),
        "phi_i": phi_i.astype(np.float32),
        "theta_i": theta_i,
        "ndf": random.uniform(0.5, 1, (3, 8)).astype(np.float32),
        "sigma": np.repeat(sigma[:1], 3, axis=0) if len(phi_i) == 1 else sigma,
        "vndf": random.uniform(0.2, 1, (*incident, 9, 12)).astype(np.float32),
        "luminance": random.uniform(0.5, 1, (*incident, 6, 6)).astype(np.float32),
        "rgb": random.uniform(0.1, 1, (*incident, 3, 6, 6)).astype(np.float32),
        "jacobian": np.array([1], dtype=np.uint8),
    }


def merl_bytes(f: np.ndarray) -> bytes:
    """A MERL file of f (theta_h, theta_d, phi_d, 3) in 1/sr; NaN becomes -1."""
    raw = np.nan_to_num(f / (np.array([1, 1.15, 1.66]) / 1500), nan=-1.0)
    return struct.pack("<3i", *f.shape[:3]) + np.moveaxis(raw, -1, 0).astype("<f8").tobytes()


def cornell_text(rows: np.ndarray, wavelengths_nm: np.ndarray) -> str:
    """A Cornell file."""
    lines = ["# made up", str(len(wavelengths_nm)), " ".join(f"{w:g}" for w in wavelengths_nm)]
    return "\n".join(lines + [" ".join(f"{v:.8g}" for v in row) for row in rows]) + "\n"


def cornell_rows(value: float = 0.2, count: int = 60, wavelengths: int = 5) -> np.ndarray:
    random = np.random.default_rng(0)
    angles = random.uniform((0, 0, 0, 0), (1.2, 6.2, 1.2, 6.2), (count, 4))
    return np.column_stack([angles, np.full((count, wavelengths), value)])


GLOSSY = Material(name="glossy", kd=(0.3, 0.2, 0.1), lobes=(Lobe(k=(0.4, 0.4, 0.4), mx=0.2, my=0.2),))


def zemax_text(
    evaluate, symmetry: str, kind: str = "BRDF", rotations: tuple[int, ...] = (0,), azimuth: tuple[int, ...] = ()
) -> str:
    """A Zemax file of f(wi, wo) with 1 or 3 channels; below the horizon it has zeros, TIS is .5 throughout."""
    incident, radial = (10, 40, 70), np.array([0, 5, 15, 30, 50, 70, 90])
    azimuth = azimuth or tuple(range(0, 181 if symmetry == "PlaneSymmetrical" else 360, 30))
    side = -1 if kind == "BTDF" else 1
    blocks = []
    for rotation in rotations:
        for theta in incident:
            wi, wo = direction(np.radians(theta), 0.0), outgoing(theta, *np.meshgrid(azimuth, radial, indexing="ij"))
            seen = (about_n(w, rotation) for w in (np.broadcast_to(wi, wo.shape), wo * (1, 1, side)))
            blocks.append(evaluate(*seen) * (wo[..., 2:] > 0))
    lines = ["# made up", "Source\tMeasured", f"Symmetry\t{symmetry}"]
    channels = blocks[0].shape[-1]
    lines += [f"SpectralContent\t{'Monochrome' if channels == 1 else 'XYZ'}", f"ScatterType\t{kind}"]
    names = ("SampleRotation", "AngleOfIncidence", "ScatterAzimuth", "ScatterRadial")
    for name, angles in zip(names, (rotations, incident, azimuth, radial), strict=True):
        lines += [f"{name}\t{len(angles)}", "\t".join(f"{angle:g}" for angle in angles)]
    for channel in range(channels):
        lines += ["", "Monochrome" if channels == 1 else f"Tristimulus{'XYZ'[channel]}", "DataBegin"]
        for block in blocks:
            lines.append("TIS\t0.5")
            lines += ["\t".join(f"{value:.6e}" for value in row) for row in block[..., channel]]
        lines.append("DataEnd")
    return "\n".join(lines) + "\n"


def fred_text(blocks: dict[tuple[float, float], tuple[np.ndarray, np.ndarray]], words: str = "") -> str:
    """A FRED file: specular direction -> ((N, 2) angles, (N,) values)."""
    lines = ["type bsdf_data", f"format {words or 'angles=deg bsdf=value scale=1'}"]
    for (theta, phi), (angles, values) in blocks.items():
        lines.append(f"{theta:g}\t{phi:g}")
        lines += [f"{a:.9g}\t{b:.9g}\t{v:.9g}" for (a, b), v in zip(angles, values, strict=True)]
    return "\n".join(lines) + "\n"


def alta_text(name: str, columns: np.ndarray, values: np.ndarray, out: str = "INV_STERADIAN", vs: str = "") -> str:
    """An ALTA file as data2data writes it: the rows end in a tab."""
    values = values.reshape(len(columns), -1)
    stated = len(values[0]) - sum(int(word) for word in vs.split())
    lines = ["# made up", f"#DIM {columns.shape[1]} {stated}", f"#PARAM_IN  {name}", f"#PARAM_OUT {out}"]
    lines += [f"#VS {vs}"] * bool(vs)
    return "\n".join(lines + ["".join(f"{v:.15g}\t" for v in row) for row in np.hstack([columns, values])]) + "\n"


def glossy(wi, wo):
    """Isotropic: a lobe about the mirror direction, or about straight transmission, on a diffuse ground."""
    ahead = wi * (-1, -1, 1) * np.where(wi[..., 2:] * wo[..., 2:] < 0, (1, 1, -1), (1, 1, 1))
    return 0.1 + 3 * np.exp(20 * ((ahead * wo).sum(axis=-1) - 1))


def beam(theta_i, phi_i, f=glossy, kind="DSF", far=False, head="", step=(6, 15)) -> str:
    """One incident direction, as Mountain writes it; outgoing angles in the coordinates of the light's."""
    theta, phi = (a.ravel() for a in np.meshgrid(np.arange(0, 90, step[0]), np.arange(0, 360, step[1])))
    theta = 180 - theta if far != (theta_i > 90) else theta
    wi, wo = direction(np.radians(theta_i), np.radians(phi_i)), direction(*np.radians([theta, phi]))
    values = f(np.broadcast_to(wi, wo.shape), wo) * (np.abs(wo[:, 2]) if kind == "DSF" else 1)
    lines = ['#mountain-version\t"1.9"', '#sample_name\t"felt 7"', f"#format: theta phi {kind}", head.rstrip("\n")]
    lines += [f"#incident_angle\t{theta_i:g}\t{phi_i:g}", f"#datapoints_in_file\t{len(theta)}"]
    lines += [f"{t:.3f}\t{p:.3f}\t{v:.6g}" for t, p, v in zip(theta, phi, values, strict=True)]
    return "\n".join(line for line in lines if line) + "\n"


SIGMA, PHI, THETA = (0, 30, 60, 90), (0, 45, 90, 135, 180, 225, 270, 315), (0, 5, 10, 20, 40, 60, 90, 120, 150)
CHANNELS = {"BW": ["bw"], "RGB": ["red", "gre", "blu"], "spectral 3": ["wl 450", "wl 550", "wl 650"]}


def lobe(wi, wo):
    """Not mirror symmetric: the sense of the azimuth shows."""
    ahead = wi * (-1, -1, 1)
    return 0.1 + 0.05 * wo[..., 1] + 2 * np.exp(20 * ((ahead * wo).sum(axis=-1) - 1))


def outgoing(specular_deg: float, phi_deg: np.ndarray | float, theta_deg: np.ndarray | float) -> np.ndarray:
    """libbsdf's SpecularCoordinateSystem: directions about n, turned about y until n is the mirror direction."""
    w, s = direction(np.radians(theta_deg), np.radians(phi_deg)), np.radians(specular_deg)
    return np.stack([np.cos(s) * w[..., 0] - np.sin(s) * w[..., 2], w[..., 1],
                     np.sin(s) * w[..., 0] + np.cos(s) * w[..., 2]], axis=-1)  # fmt: skip


def about_n(w: np.ndarray, turn_deg: float) -> np.ndarray:
    """Directions (..., 3) turned about n, counter-clockwise."""
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    return w @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def ddr(f=lobe, *, phi=PHI, model="BW", kind="Luminance Absolute", kbdf=0.8, psi=None, sigmat=None, tint=(1.0,)) -> str:
    """A file as libbsdf's DdrWriter lays it out."""
    lines = [";; made up", "", "Source Measured", "TypeSym ASymmetrical", f"TypeColorModel {model}", f"TypeData {kind}"]
    for name, listed in (("psi", psi), ("sigma", SIGMA), ("sigmat", sigmat), ("phi", phi), ("theta", THETA)):
        if listed is not None:
            lines += [name if name == "sigmat" else f"{name} {len(listed)}", " " + " ".join(f"{a:g}" for a in listed)]
    for name, share in zip(CHANNELS[model], tint, strict=True):
        lines.append(name)
        if kbdf:
            lines += [" kbdf", "  " + " ".join([f"{kbdf:g}"] * (len(SIGMA) * len(psi or (0,))))]
        lines.append(" def")
        for turn in psi or (0,):
            lines.append(f";; Psi = {turn}")
            for i, sigma in enumerate(SIGMA):
                wi = direction(np.radians(sigma), 0.0)
                wo = outgoing((sigmat or SIGMA)[i], *np.meshgrid(phi, THETA, indexing="ij"))
                values = np.where(wo[..., 2] > 1e-9, f(wi, wo) * share * np.pi / (kbdf or 1), 0.0)
                values = values * wo[..., 2] / np.pi if kind.startswith("Intensity") else values
                lines += [" " + " ".join(f"{v:.8g}" for v in row) for row in values]
        lines.append(" enddef")
    return "\n".join(lines) + "\n"


AZIMUTH, RADIAL = range(0, 361, 30), (0, 15, 30, 45, 60, 75)


def lighttools(f=lobe, *, sides=("Front",), kinds=("BRDF",), channels=((550, ""),), xyz=False, poi=(0,)) -> str:
    """A file of LightTools: the light is at azimuth 90."""
    lines = ["# made up", "Symmetry Asymmetric", f"SpectralContent {'XYZ' if xyz else 'Monochrome'}"]
    for name, listed in (("ScatterAzimuth", AZIMUTH), ("ScatterRadial", RADIAL)):
        lines += [f"{name} {len(listed)}", "\t".join(str(a) for a in listed)]
    lines.append("DataBegin")
    for side, kind, aoi, plane in ((s, k, a, p) for s in sides for k in kinds for a in (0, 30, 60) for p in poi):
        for number, (wavelength, trisimulus) in enumerate(channels):
            lines += [f"AOI {aoi}", f"POI {plane}", f"Side {side}", f"Wavelength {wavelength}", f"ScatterType {kind}"]
            lines += [f"TristimulusValue {trisimulus}"] * bool(trisimulus) + ["TIS 0.3"]
            wi, scale = direction(np.radians(aoi), 0.0), (1 + number * (not xyz)) * (10 if side == "Back" else 1)
            for azimuth in np.radians(np.array(AZIMUTH) - 90.0):
                values = [f(wi, direction(np.radians(r), azimuth)) * scale for r in RADIAL]
                lines.append("\t".join(f"{v:.7e}" for v in values))
    return "\n".join([*lines, "DataEnd"]) + "\n"
