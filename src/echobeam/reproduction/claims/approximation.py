"""Claim on the evolution model's approximation (the paper's approx)."""

from __future__ import annotations

import numpy as np

from echobeam.reproduction.figures.approximation import states
from echobeam.reproduction.records import Claim, Estimate, Measured
from echobeam.reproduction.results import Results
from echobeam.reproduction.rules import all_below


def largest_errors(results: Results) -> Measured:
    """Measure the largest error of distance and angle over the slots, % of the value."""
    exact, paper = states("exact"), states("paper")
    share = 100 * np.max(np.abs(paper / exact - 1.0), axis=0)
    return Measured({"distance": Estimate.exact(share[1]), "angle": Estimate.exact(share[0])}, "%")


CLAIMS = (
    Claim(
        "approximation-minimal",
        "approx",
        "despite a relatively large value of the slot, the discrepancy between real and predicted "
        "values remains minimal",
        "minimal",
        "largest error over 40 slots of 50 ms, open loop, as a share of the true value; minimal: "
        "below 1 %. Eq. (33) with the plus sign that is missing in print: as printed the first "
        "slot's error is above 50 degrees",
        largest_errors,
        all_below(1.0),
    ),
)
