"""Rules that turn measured numbers into verdicts. Each can say all that it claims to tell apart."""

from __future__ import annotations

from collections.abc import Callable

from echobeam.reproduction.records import Estimate, Measured, Rule, Verdict


def near(paper: float, share: float = 0.2) -> Rule:
    """Compare the headline with a number that the paper prints.

    The paper gives no interval and not all of its parameters, so that a tolerance has to stand
    for both; the sign is demanded of our whole interval.

    Parameters
    ----------
    paper
        The printed value, positive.
    share
        Tolerance as a share of it.
    """
    low, high = (1 - share) * paper, (1 + share) * paper

    def decide(measured: Measured) -> Verdict:
        ours = measured.headline
        if not ours.low > 0:
            return "not reproduced"
        return "reproduced" if low <= ours.value <= high else "in part"

    return Rule(
        f"reproduced: ours lies within {100 * share:.0f} % of the paper's value ({low:.0f} to "
        f"{high:.0f}) and its interval above 0; in part: only the latter; else not reproduced",
        decide,
    )


def all_above(bound: float = 0.0) -> Rule:
    """Demand of every estimate that its whole interval lies above a bound."""
    return _all(f"above {bound:g}", lambda one: one.low > bound)


def all_below(bound: float) -> Rule:
    """Demand of every estimate that its whole interval lies below a bound."""
    return _all(f"below {bound:g}", lambda one: one.high < bound)


def within(targets: dict[str, tuple[float, float]], ordering: tuple[str, str]) -> Rule:
    """Demand of named estimates that their values lie in given ranges.

    Parameters
    ----------
    targets
        Range of each.
    ordering
        Two names; if the ranges are missed but the first is below the second: in part.
    """

    def decide(measured: Measured) -> Verdict:
        found = measured.estimates
        if all(low <= found[name].value <= high for name, (low, high) in targets.items()):
            return "reproduced"
        less, more = (found[name].value for name in ordering)
        return "in part" if less < more else "not reproduced"

    ranges = ", ".join(f"{name} in {low:g} to {high:g}" for name, (low, high) in targets.items())
    return Rule(
        f"reproduced: {ranges}; in part: only {ordering[0]} below {ordering[1]}; "
        "else not reproduced",
        decide,
    )


def _all(words: str, holds: Callable[[Estimate], bool]) -> Rule:
    def tends(measured: Measured) -> bool:
        values = [Estimate.exact(one.value) for one in measured.estimates.values()]
        return all(holds(value) for value in values)

    def decide(measured: Measured) -> Verdict:
        held = [holds(one) for one in measured.estimates.values()]
        if all(held):
            return "reproduced"
        return "in part" if any(held) or tends(measured) else "not reproduced"

    return Rule(
        f"reproduced: the interval of every estimate lies {words}; in part: that of some, or only "
        "all values; else not reproduced",
        decide,
    )


def inside(low: float, high: float, least: float, most: float, unit: str) -> Rule:
    """Compare the headline with a range that the paper gives.

    Parameters
    ----------
    low, high
        The paper's range.
    least, most
        What was looked at; a value in there but outside the paper's range is half the claim.
    unit
        Of all of them.
    """

    def decide(measured: Measured) -> Verdict:
        value = measured.headline.value
        if low <= value <= high:
            return "reproduced"
        return "in part" if least <= value <= most else "not reproduced"

    return Rule(
        f"reproduced: within {low:g} to {high:g} {unit}; in part: within {least:g} to {most:g} "
        f"{unit}; else not reproduced",
        decide,
    )
