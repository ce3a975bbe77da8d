"""The paper's sentences with a number or an ordering, each with its measure and its rule."""

from __future__ import annotations

from echobeam.reproduction.claims import (
    approximation,
    beams,
    height,
    long_run,
    rates,
    resolution,
    tracking,
)
from echobeam.reproduction.records import Claim

ALL: tuple[Claim, ...] = (
    *approximation.CLAIMS,
    *rates.CLAIMS,
    *beams.CLAIMS,
    *tracking.CLAIMS,
    *long_run.CLAIMS,
    *height.CLAIMS,
    *resolution.CLAIMS,
)
"""All claims, in the paper's order."""
