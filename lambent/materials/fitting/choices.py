"""Options of a fit in the command line and the editor, with a common default."""

from __future__ import annotations

from typing import Literal, get_args

Lobes = int | Literal["auto", "curve"]
MAX_LOBES = 4
DistributionChoice = Literal["beckmann", "ggx", "best"]
DISTRIBUTION_CHOICES: tuple[DistributionChoice, ...] = get_args(DistributionChoice)
DISTRIBUTION: DistributionChoice = DISTRIBUTION_CHOICES[0]  # default of a fit
