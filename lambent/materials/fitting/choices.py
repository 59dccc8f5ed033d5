"""Choices of a fit that the command line and the editor offer, with one default for both."""

from __future__ import annotations

from typing import Literal, get_args

DistributionChoice = Literal["beckmann", "ggx", "best"]
DISTRIBUTION_CHOICES: tuple[DistributionChoice, ...] = get_args(DistributionChoice)
DISTRIBUTION: DistributionChoice = DISTRIBUTION_CHOICES[0]  # that of a fit nobody chose another one for
