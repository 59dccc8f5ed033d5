"""Reflectances of named metals, and refractive indices of named dielectrics, as Mitsuba names them.

The reflectances are those at normal incidence, ((eta - 1)^2 + k^2)/((eta + 1)^2 + k^2), of the spectra of eta and k
that Mitsuba ships (from the tables of its "conductor" plugin, after Palik and the SOPRA data), as linear RGB under D65.
"""

from __future__ import annotations

# fmt: off
R0 = {
    "a-C": (0.212, 0.212, 0.2), "Ag": (0.972, 0.96, 0.915), "Al": (0.913, 0.921, 0.924), "AlAs": (0.286, 0.26, 0.479),
    "AlSb": (0.351, 0.385, 0.478), "Au": (1, 0.782, 0.344), "Be": (0.539, 0.538, 0.537), "Cr": (0.635, 0.662, 0.705),
    "CsI": (0.079, 0.081, 0.086), "Cu": (0.955, 0.638, 0.538), "Cu2O": (0.243, 0.265, 0.273),
    "CuO": (0.221, 0.217, 0.216), "d-C": (0.171, 0.173, 0.176), "Hg": (0.781, 0.78, 0.778),
    "HgTe": (0.405, 0.384, 0.385), "Ir": (0.701, 0.693, 0.656), "K": (0.95, 0.938, 0.921),
    "Li": (0.916, 0.889, 0.808), "MgO": (0.072, 0.073, 0.075), "Mo": (0.559, 0.579, 0.57),
    "Na": (0.977, 0.961, 0.936), "Nb": (0.504, 0.507, 0.505), "Ni": (0.659, 0.609, 0.526),
    "Rh": (0.797, 0.765, 0.743), "Se": (0.316, 0.27, 0.276), "Se-e": (0.439, 0.422, 0.456),
    "SiC": (0.202, 0.206, 0.214), "SnTe": (0.365, 0.122, 0.031), "Ta": (0.389, 0.36, 0.412),
    "Te": (0.572, 0.593, 0.584), "Te-e": (0.657, 0.686, 0.672), "ThF4": (0.042, 0.043, 0.043),
    "TiC": (0.489, 0.458, 0.445), "TiN": (0.614, 0.461, 0.233), "TiO2": (0.232, 0.245, 0.273),
    "TiO2-e": (0.194, 0.205, 0.229), "V": (0.511, 0.528, 0.565), "VC": (0.47, 0.436, 0.414),
    "VN": (0.469, 0.41, 0.345), "W": (0.515, 0.496, 0.468),
}
IOR = {
    "vacuum": 1.0, "helium": 1.000036, "hydrogen": 1.000132, "air": 1.000277, "carbon dioxide": 1.00045,
    "water": 1.333, "acetone": 1.36, "ethanol": 1.361, "carbon tetrachloride": 1.461, "glycerol": 1.4729,
    "benzene": 1.501, "silicone oil": 1.52045, "bromine": 1.661, "water ice": 1.31, "fused quartz": 1.458,
    "pyrex": 1.47, "acrylic glass": 1.49, "polypropylene": 1.49, "bk7": 1.5046, "sodium chloride": 1.544,
    "amber": 1.55, "pet": 1.575, "diamond": 2.419,
}
# fmt: on
