"""Small files of ALTA, pab-opto, Integra and LightTools, made from functions whose answer is known."""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.directions import direction


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


def outgoing(specular_deg: float, phi_deg: float, theta_deg: float) -> np.ndarray:
    """libbsdf's SpecularCoordinateSystem: a direction about n, turned about y until n is the mirror direction."""
    w, s = direction(np.radians(theta_deg), np.radians(phi_deg)), np.radians(specular_deg)
    return np.array([np.cos(s) * w[0] - np.sin(s) * w[2], w[1], np.sin(s) * w[0] + np.cos(s) * w[2]])


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
                for a in phi:
                    wo = [outgoing((sigmat or SIGMA)[i], a, t) for t in THETA]
                    values = [f(wi, w) * share * np.pi / (kbdf or 1) if w[2] > 1e-9 else 0.0 for w in wo]
                    if kind.startswith("Intensity"):
                        values = [v * w[2] / np.pi for v, w in zip(values, wo, strict=True)]
                    lines.append(" " + " ".join(f"{v:.8g}" for v in values))
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
