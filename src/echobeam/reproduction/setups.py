"""Setups of the figures: the paper's scenarios with a few keys changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

from echobeam.scenario.load import load_scenario
from echobeam.scenario.model import Scenario
from echobeam.sweeps.points import Point

ANTENNAS = (20, 30, 40)
"""Array sizes for one object, around the paper's 30 antennas."""

ANTENNAS_FOR_TWO = (30, 40, 50)
"""Array sizes for two objects: smaller arrays cannot meet the rate floor of 4e-4."""

HEIGHTS = (95, 100, 105, 110, 115, 120)
"""Heights of the comparison with water-filling, m; the paper shows 100, 105 and 110."""

RESOLUTIONS = (0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0)
"""Angular resolutions, deg."""

RESOLUTION_LINES = ((30, 85), (30, 90), (30, 95), (25, 90), (35, 90))
"""Antennas and height in m of the lines over the angular resolution."""

RIPPLES = (0.1, 0.17)
"""Ripples per antenna of the lines over the angular resolution; the first is the default."""

CALIBRATED = (
    "P_T = 1, ripple 0.1 N_t, min_rate 4e-4 and the pilot's held coverage beam are not in the "
    "paper; they were chosen because they agree with its numbers"
)
"""Note on every claim that depends on calibrated values."""

Overrides = tuple[tuple[str, object], ...]


@dataclass(frozen=True, slots=True)
class Setup:
    """Scenario to be run; setups with the same name are equal.

    Attributes
    ----------
    name
        Unique name.
    preset, overrides
        A built-in scenario and dotted keys of it with their values.
    schemes
        Names of the schemes.
    keep
        Variables of the result stored trial by trial, besides the statistics.
    share
        Number of trials as a share of the requested one.
    """

    name: str
    preset: str
    schemes: tuple[str, ...] = ("temporal", "pilot")
    overrides: Overrides = ()
    keep: tuple[str, ...] = ()
    share: float = 1.0

    def scenario(self) -> Scenario:
        """Return the scenario, validated."""
        return _load(self.preset, self.overrides)

    def point(self, trials: int) -> Point:
        """Return the point of a study for this setup."""
        count = max(2, round(self.share * trials))
        return Point(self.name, self.scenario(), self.schemes, count, self.keep)


@lru_cache
def _load(preset: str, overrides: Overrides) -> Scenario:
    return load_scenario(preset, dict(overrides))


def _array(n: int, ripple: float = RIPPLES[0]) -> Overrides:
    """Return the overrides for an array size, and the ripple that scales with it."""
    return (("array.n_tx", n), ("coverage.ripple", f"{ripple:g} N_t"))


HEADLINE_SHARE = 15.0
"""Trials for the paper's two percentages, relative to the other setups: 3,000 by default, for 95 %
intervals of about plus or minus 1.5 percentage points."""


COMPARED = ("temporal", "pilot", "posterior")
"""The paper's two schemes, and the one that goes beyond it."""


def headline(preset: str) -> Setup:
    """Return a frame whose improvement in slot 6 the paper gives as a number."""
    return Setup(f"headline-{preset}", preset, COMPARED, share=HEADLINE_SHARE)


def multi(n: int = 30) -> Setup:
    """Return the paper's two objects, for a given array size."""
    keep = ("truth", "predicted", "estimated", "beam", "rate")
    return Setup(f"multi-n{n}", "paper-multi", COMPARED, _array(n), keep)


def single(n: int = 30) -> Setup:
    """Return the paper's single object at 60 degrees."""
    keep = ("truth", "estimated")
    return Setup(f"single-n{n}", "paper-single", COMPARED, _array(n), keep)


def long() -> Setup:
    """Return the paper's two objects over 500 ms."""
    return Setup("long", "paper-long", (*COMPARED, "genie"), keep=("truth", "estimated"))


BRAKING = 8.0
"""Deceleration of an emergency stop on a dry road, m/s^2."""


def manoeuvre() -> Setup:
    """Return the same objects, one braking and one accelerating by `BRAKING`."""
    accelerations = (("objects.0.acceleration", -BRAKING), ("objects.1.acceleration", BRAKING))
    return Setup("manoeuvre", "paper-long", overrides=accelerations)


def trajectory() -> Setup:
    """Return the paper's trajectories, with a quarter of the trials, since they are long."""
    keep = (
        "truth", "predicted", "estimated", "estimated_cov", "uav_position", "uav_velocity"
    )  # fmt: skip
    return Setup("trajectory", "paper-trajectory", ("temporal",), keep=keep, share=0.25)


def height(metres: int) -> Setup:
    """Return the single object at 45 degrees, for a given height."""
    return Setup(
        f"height-{metres}",
        "paper-height",
        ("temporal", "water-filling", "posterior"),
        (("uav.height", float(metres)), *_array(30)),
        keep=("truth", "estimated"),
    )


def resolution(n: int, metres: int, degrees: float, ripple: float = RIPPLES[0]) -> Setup:
    """Return the single object at 60 degrees, covered on a grid of some step."""
    overrides = (
        ("uav.height", float(metres)),
        *_array(n, ripple),
        ("coverage.resolution", f"{degrees:g} deg"),
    )
    name = f"resolution-n{n}-h{metres}-b{ripple:g}-{degrees:g}"
    return Setup(name, "paper-single", ("temporal",), overrides)


@dataclass(frozen=True, slots=True)
class Variation:
    """Change of one reading from the default, for any setup.

    Attributes
    ----------
    label
        Text of the change, the value last.
    overrides
        Dotted keys with their changed values.
    power
        P_T as a multiple of the setup's; a rate floor is scaled in proportion.
    stands_in
        Replacements of schemes, by name of the replaced scheme.
    floored
        Whether it affects only setups with a rate floor.
    """

    label: str
    overrides: Overrides = ()
    power: float = 1.0
    stands_in: Mapping[str, str] = field(default_factory=dict)
    floored: bool = False

    def touches(self, setup: Setup) -> bool:
        """Return whether the variation changes a setup."""
        if self.floored:
            return _floor(setup) > 0
        if self.stands_in:
            return any(scheme in self.stands_in for scheme in setup.schemes)
        if not self.overrides:
            return True
        return _load(setup.preset, (*setup.overrides, *self.overrides)) != setup.scenario()

    def named(self, name: str) -> str:
        """Return the name of a setup under the variation."""
        return f"{name}, {self.label}"


DEFAULT = Variation("default reading")

VARIATIONS = (
    # nothing else changed: shows the effect of the number of trials
    Variation("fewer trials", floored=True),
    *(Variation(f"P_T = {power:g}", power=power) for power in (0.5, 2.0, 10.0)),
    *(Variation(f"ripple {ripple:g}", (("coverage.ripple", ripple),)) for ripple in (1.0, 5.0)),
    *(
        Variation(f"min_rate {text}", (("coverage.min_rate", float(text)),), floored=True)
        for text in ("0", "1e-4", "2e-4")
    ),
    Variation("known variance", (("radar.variance", "known"),)),
    Variation("cover around the last estimate", (("coverage.centre", "previous"),)),
    Variation("cover by the prior's own deviation", (("coverage.spread", "posterior"),)),
    Variation("process noise in nature", (("truth.process_noise", True),)),
    Variation("pilot held on a needle beam", stands_in={"pilot": "pilot-needle"}),
    # for two objects the exact bound requires coverage that no beam provides above the floor
    Variation("exact CRB", (("radar.crb", "exact"),)),
    Variation(
        "exact CRB with min_rate 0",
        (("radar.crb", "exact"), ("coverage.min_rate", 0.0)),
        floored=True,
    ),
)
"""Variations of one reading from the default: P_T = 1, ripple 0.1 N_t, floor 4e-4, the paper's CRB
at the prediction, cover around the prediction."""

MAP_SHARE = 0.3
"""Trials of a changed reading as a share of the default's, if a floor makes them expensive."""


def claimed(schemes: tuple[str, ...]) -> tuple[str, ...]:
    """Return those of some schemes that the paper's claims are about."""
    return tuple(one for one in schemes if one != "posterior")


def varied(setup: Setup, variation: Variation) -> Setup:
    """Return a setup under a variation, with fewer trials if it has a rate floor."""
    return replace(
        setup,
        name=variation.named(setup.name),
        schemes=tuple(variation.stands_in.get(one, one) for one in claimed(setup.schemes)),
        overrides=(*setup.overrides, *_scaled(setup, variation.power), *variation.overrides),
        share=min(setup.share, 1.0) * (MAP_SHARE if _floor(setup) else 1.0),
    )


def _scaled(setup: Setup, power: float) -> Overrides:
    """Return a multiple of P_T, and of the rate floor if there is one."""
    if power == 1.0:
        return ()
    scaled: Overrides = (("radio.power", power * setup.scenario().radio.power),)
    floor = _floor(setup)
    return (*scaled, ("coverage.min_rate", power * floor)) if floor else scaled


def _floor(setup: Setup) -> float:
    return setup.scenario().coverage.min_rate
