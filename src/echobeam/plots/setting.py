"""Values of a result's scenario that pictures need, and the choice of scheme and trial."""

from __future__ import annotations

import textwrap
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from echobeam.faults import InputError
from echobeam.physics.array import LinearArray
from echobeam.scenario.checking import ScenarioError, checked
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import split, system_for
from echobeam.units import QuantityError, parse_quantity
from echobeam.values import Mode

if TYPE_CHECKING:
    import xarray as xr


class PlotError(InputError):
    """A picture that cannot be drawn from this result, or not under this name."""


@dataclass(frozen=True, slots=True)
class Setting:
    """The scenario's values as pictures use them, SI units and radians.

    What the result's scenario does not say is None, or the value of the paper where a curve
    needs one (``array``, ``power``, ``width``).
    """

    name: str
    trials: int
    array: LinearArray
    power: float
    width: float
    centre: str
    slot: float | None
    height: float | None

    @property
    def n_tx(self) -> int:
        """N_t."""
        return self.array.n

    def title(self, scheme: str = "", trial: int | None = None, width: int = 100) -> str:
        """Return a picture's title: scenario, antennas, height, trials; wrapped at ``width``.

        Parameters
        ----------
        scheme
            The scheme shown, if it is only one.
        trial
            The trial shown, counted from 0, if it is only one.
        width
            Characters per line.
        """
        parts = [scheme] if scheme else []
        parts.append(f"$N_t$ = {self.n_tx}")
        if self.height is not None:
            parts.append(f"$h$ = {self.height:g} m")
        trials = f"{self.trials} trial{'' if self.trials == 1 else 's'}"
        parts.append(trials if trial is None else f"trial {trial + 1} of {self.trials}")
        text = ", ".join(parts)
        # A $ in a name would open a formula.
        name = self.name.replace("$", r"\$")
        return textwrap.fill(f"{name}: {text}" if name else text, width)


def read_setting(result: xr.Dataset, scheme: str = "") -> Setting:
    """Return the setting of a result from its attribute ``scenario`` (TOML text).

    The coverage is that of a scheme, which may have its own.
    """
    text = str(result.attrs.get("scenario", ""))
    try:
        scenario: Mapping[str, Any] = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        scenario = {}
    n_tx = result.sizes.get("antenna", 0) or int(_number(scenario, "array", "n_tx", "number", 0.0))
    whole = read_scenario(result)
    width = _number(scenario, "coverage", "width", "number", 3.0)
    centre = "predicted"
    if whole is not None:
        coverage = system_for(whole, scheme).coverage if scheme else whole.coverage
        width, centre = coverage.width, coverage.centre
    return Setting(
        name=str(scenario.get("name", "")),
        trials=int(result.sizes.get("trial", 0)),
        array=LinearArray(
            max(int(n_tx), 1),
            _number(scenario, "array", "spacing", "number", 0.5),
            "horizontal" if _value(scenario, "array", "axis") == "horizontal" else "vertical",
        ),
        power=_number(scenario, "radio", "power", "number", 1.0),
        width=width,
        centre=centre,
        slot=_optional(scenario, "frame", "slot", "time"),
        height=_optional(scenario, "uav", "height", "length"),
    )


def read_scenario(result: xr.Dataset) -> Scenario | None:
    """Return the complete scenario of a result, None if its attributes do not hold one."""
    try:
        document = tomllib.loads(str(result.attrs["scenario"]))
        return checked(Scenario, document, "the result's scenario")
    except (KeyError, tomllib.TOMLDecodeError, ScenarioError):
        return None


def check_variables(result: xr.Dataset, *names: str) -> None:
    """Raise `PlotError` if a result lacks one of these variables."""
    missing = [name for name in names if name not in result.variables]
    if missing:
        raise PlotError(f"the result holds no {', '.join(missing)}; is it from `echobeam run`?")


def choose_scheme(result: xr.Dataset, wanted: str | None) -> str:
    """Return the scheme to draw: the wanted one, else temporal or the first of its variants.

    A result without any shows its first scheme with directional slots.

    Raises
    ------
    PlotError
        If the result holds no such scheme, or none at all.
    """
    names = [str(name) for name in result["scheme"].values]
    if not names:
        raise PlotError("the result holds no scheme")
    if wanted is not None:
        if wanted not in names:
            raise PlotError(f"the result holds no scheme {wanted!r}; it holds {', '.join(names)}")
        return wanted
    variants = [name for name in names if split(name)[0] == "temporal"]
    variants.sort(key=lambda name: name != "temporal")
    directional = (result["mode"] == Mode.DIRECTIONAL).any(("trial", "slot")).values
    others = (name for name, some in zip(names, directional, strict=True) if some)
    return next(iter(variants), next(others, names[0]))


def check_trial(result: xr.Dataset, trial: int) -> None:
    """Raise `PlotError` if a result has no such trial (counted from 0)."""
    if not 0 <= trial < result.sizes["trial"]:
        raise PlotError(
            f"the result holds no trial {trial}; it holds 0 to {result.sizes['trial'] - 1}"
        )


def _value(scenario: Mapping[str, Any], table: str, key: str) -> Any:
    section = scenario.get(table)
    return section.get(key) if isinstance(section, Mapping) else None


def _optional(scenario: Mapping[str, Any], table: str, key: str, kind: str) -> float | None:
    try:
        return parse_quantity(_value(scenario, table, key), kind)
    except QuantityError:
        return None


def _number(scenario: Mapping[str, Any], table: str, key: str, kind: str, default: float) -> float:
    number = _optional(scenario, table, key, kind)
    return default if number is None else number
