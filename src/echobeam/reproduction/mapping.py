"""Sensitivity map: claims measured again under other values that the paper leaves open."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache

from echobeam.reproduction.discovery import find_claims
from echobeam.reproduction.figures import (
    height_angles,
    height_rates,
    long_run,
    patterns_slots,
    rates,
)
from echobeam.reproduction.records import Claim, Entry, Finding
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import DEFAULT, VARIATIONS, Setup, Variation, varied

FIGURES = (
    rates.FIGURE,
    patterns_slots.FIGURE,
    long_run.FIGURE,
    height_rates.FIGURE,
    height_angles.FIGURE,
)
"""Figures whose claims are mapped."""

BASES = {setup.name: setup for figure in FIGURES for setup in figure.points}
"""Setups of these claims, by name."""

CLAIMS = tuple(claim for figure in FIGURES for claim in find_claims() if claim.figure == figure.id)


def setups() -> tuple[Setup, ...]:
    """Return the default setups and those that differ from them in one reading."""
    changed = [
        varied(base, variation)
        for variation in VARIATIONS
        for base in BASES.values()
        if variation.touches(base)
    ]
    return (*BASES.values(), *changed)


def entries(results: Results, claims: Iterable[Claim] = CLAIMS) -> list[Entry]:
    """Return the map: each claim under the default reading, then under those that affect it."""
    return [entry for claim in claims for entry in _of(claim, results)]


@lru_cache(maxsize=len(CLAIMS))
def _of(claim: Claim, results: Results) -> tuple[Entry, ...]:
    """Return one claim's rows; cached, since picture and report show the same results."""
    default = results.under(DEFAULT, ())
    found = [_entry(claim, default, DEFAULT)]
    # fallbacks of a setup are counted only for the schemes that the claim uses
    measured_on = [
        replace(BASES[outcome.point.name], schemes=tuple(outcome.asked))
        for outcome in _asked(default)
    ]
    for variation in VARIATIONS:
        touched = [setup.name for setup in measured_on if variation.touches(setup)]
        if touched:
            found.append(_entry(claim, results.under(variation, touched), variation))
    return tuple(found)


def _entry(claim: Claim, results: Results, variation: Variation) -> Entry:
    """Measure and judge a claim on results without recorded accesses."""
    finding = Finding(claim, claim.measure(results))
    outcomes = _asked(results)
    return Entry(
        finding,
        variation.label,
        min(outcome.point.trials for outcome in outcomes),
        max(outcome.fallbacks(scheme) for outcome in outcomes for scheme in set(outcome.asked)),
    )


def _asked(results: Results) -> list[Outcome]:
    """Return the outcomes that a measure has used."""
    return [outcome for outcome in results.outcomes.values() if outcome.asked]
