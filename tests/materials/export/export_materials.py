"""Materials that every writer is tested with."""

from __future__ import annotations

from lambent.materials.document import Lobe, Material

PLASTIC = Material(name="red plastic", kd=(0.3, 0.1, 0.05), lobes=(Lobe(k=1, mx=0.1, my=0.1, r0=0.04, alpha=0.3),))
BRUSHED = Material(
    name="brushed, two lobes",
    kd=0.003,
    lobes=(Lobe(k=0.9, mx=0.11, my=0.07, r0=0.87, alpha=0.45), Lobe(k=0.12, mx=0.25, my=0.17, r0=0.89, alpha=0.6)),
)
GOLD = Material(name="gold", lobes=(Lobe(distribution="ggx", k=1, mx=0.2, my=0.2, r0=(1, 0.8, 0.4), alpha=0.4),))
FOIL = Material(
    name="4 % foil",
    kd=0.5,
    kt_d=(0.1, 0.2, 0.3),
    lobes=(
        Lobe(k=0.78, mx=0.07, my=0.2, r0=0.029, alpha=0.5),
        Lobe(side="transmission", k=0.67, mx=0.17, my=0.25, r0=0.25, alpha=0.6),
    ),
)
PAPER = Material(name="-- paper", kd=0.6, kt_d=0.2)
VARNISH = Material(name="varnish", kd=(0.5, 0.3, 0.1), kd_coupled=True, lobes=(Lobe(mx=0.05, my=0.05, k=0.8),))
BLACK = Material(name="black")
ALL = {material.name: material for material in (PLASTIC, BRUSHED, GOLD, FOIL, PAPER, VARNISH, BLACK)}
