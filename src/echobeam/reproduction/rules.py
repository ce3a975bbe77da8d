"""Rules from measured numbers to verdicts. Each rule can return all of its verdicts."""

from __future__ import annotations

from collections.abc import Callable

from echobeam.reproduction.records import Estimate, Measured, Rule, Verdict


def near(paper: float, share: float = 0.2) -> Rule:
    """Compare the headline with a number printed in the paper.

    The paper gives no interval and not all of its parameters, hence the tolerance. Our whole
    interval must have the right sign, and agreement requires that its half-width is within the
    tolerance.

    Parameters
    ----------
    paper
        The printed value, positive.
    share
        Tolerance as a share of this value.
    """
    low, high = (1 - share) * paper, (1 + share) * paper

    def decide(measured: Measured) -> Verdict:
        ours = measured.headline
        if not ours.low > 0:
            return "not reproduced"
        known = (ours.high - ours.low) / 2 <= share * paper
        return "reproduced" if known and low <= ours.value <= high else "in part"

    return Rule(
        f"reproduced: ours lies within {100 * share:.0f} % of the paper's value ({low:.0f} to "
        f"{high:.0f}), known to plus or minus {share * paper:.0f}, its interval above 0; in part: "
        "only the last; else not reproduced",
        decide,
    )


def all_above(bound: float = 0.0) -> Rule:
    """Demand of every estimate that its whole interval lies above a bound."""
    return _all(f"above {bound:g}", lambda one: one.low > bound)


def first_above(bound: float = 0.0) -> Rule:
    """Demand of the headline that its whole interval lies above a bound; in part: its value."""

    def decide(measured: Measured) -> Verdict:
        ours = measured.headline
        if ours.low > bound:
            return "reproduced"
        return "in part" if ours.value > bound else "not reproduced"

    return Rule(
        f"reproduced: the interval of the first estimate lies above {bound:g}; in part: its value "
        "does; else not reproduced",
        decide,
    )


def all_below(bound: float) -> Rule:
    """Demand of every estimate that its whole interval lies below a bound."""
    return _all(f"below {bound:g}", lambda one: one.high < bound)


def within(targets: dict[str, tuple[float, float]], ordering: tuple[str, str]) -> Rule:
    """Demand of named estimates that their whole intervals lie in given ranges.

    Parameters
    ----------
    targets
        Range of each.
    ordering
        Two names; in part if ranges are missed but the first's interval is below the second's.
    """

    def decide(measured: Measured) -> Verdict:
        found = measured.estimates
        if all(_inside(found[name], low, high) for name, (low, high) in targets.items()):
            return "reproduced"
        less, more = (found[name] for name in ordering)
        return "in part" if less.high < more.low else "not reproduced"

    ranges = ", ".join(f"{name} in {low:g} to {high:g}" for name, (low, high) in targets.items())
    return Rule(
        f"reproduced: {ranges}, with their intervals; in part: only {ordering[0]} below "
        f"{ordering[1]}, with their intervals; else not reproduced",
        decide,
    )


def _all(words: str, holds: Callable[[Estimate], bool]) -> Rule:
    def decide(measured: Measured) -> Verdict:
        held = [holds(one) for one in measured.estimates.values()]
        if all(held):
            return "reproduced"
        return "in part" if any(held) else "not reproduced"

    return Rule(
        f"reproduced: the interval of every estimate lies {words}; in part: that of some; "
        "else not reproduced",
        decide,
    )


def _inside(one: Estimate, low: float, high: float) -> bool:
    """Return whether a whole interval lies in a range."""
    return low <= one.low and one.high <= high


def inside(low: float, high: float, least: float, most: float, unit: str) -> Rule:
    """Compare the headline with a range given in the paper.

    Parameters
    ----------
    low, high
        The paper's range.
    least, most
        Evaluated range. An interval that reaches beyond it determines no position; one inside it
        with a value outside the paper's range gives "in part".
    unit
        Unit of all ranges.
    """

    def decide(measured: Measured) -> Verdict:
        ours = measured.headline
        if not _inside(ours, least, most):
            return "not reproduced"
        return "reproduced" if low <= ours.value <= high else "in part"

    return Rule(
        f"reproduced: within {low:g} to {high:g} {unit}, its interval within {least:g} to "
        f"{most:g} {unit}; in part: only the latter; else not reproduced",
        decide,
    )
