"""Sources of pictures: a result, the choice from it, and its statistics, computed once."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from echobeam.faults import InputError
from echobeam.plots.looks import SHADE, Look, scheme_looks
from echobeam.plots.record import Axis, FigureData, Guide, Panel
from echobeam.scenario.checking import ScenarioError, checked
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import split
from echobeam.simulation.statistics import Statistics, needed, of_scheme, sum_rate
from echobeam.simulation.summary import GENIE, result_statistics
from echobeam.values import Array, IntArray, with_beams

if TYPE_CHECKING:
    import xarray as xr

MOST_SLOTS = 60
"""Largest number of slots drawn one by one; longer runs are drawn per frame, to be readable."""


class PlotError(InputError):
    """Error of a picture that cannot be drawn from a result, or of an unknown kind."""


@dataclass(frozen=True, slots=True)
class Choice:
    """Choice from a result.

    Attributes
    ----------
    schemes
        Names; all by default. Pictures of a single scheme show the first, by default ``temporal``.
    trial
        Number of the trial in the file, from 0, for pictures of one trial.
    slots
        Slots counted from 1; trajectories, tracks and forecasts take the range from first to last.
    x, quantity
        For a sweep: the key on the x axis, and the quantity on the y axis.
    title
        Title instead of the scenario's name.
    """

    schemes: tuple[str, ...] = ()
    trial: int = 0
    slots: tuple[int, ...] = ()
    x: str | None = None
    quantity: str | None = None
    title: str | None = None


class Source:
    """Result with the choice of what is shown.

    Raises
    ------
    PlotError
        If the result holds no such scheme, trial or slot, or is not a result.
    """

    def __init__(self, result: xr.Dataset, choice: Choice | None = None) -> None:
        self.choice = Choice() if choice is None else choice
        missing = [
            name for name in ("scheme", "trial", "slot", "object") if name not in result.dims
        ]
        if missing:
            raise PlotError(
                f"not a result of `echobeam run`: no dimension {', '.join(missing)} "
                "(select with a list, as in result.isel(trial=[0]), to keep it)"
            )
        if not result.sizes["scheme"]:
            raise PlotError("the result holds no scheme")
        held = [str(name) for name in result["scheme"].values]
        for name in self.choice.schemes:
            if name not in held:
                raise PlotError(f"the result holds no scheme {name!r}; it holds {', '.join(held)}")
        self.names = self.choice.schemes or tuple(held)
        self.whole = result
        self.result = result.isel(scheme=[held.index(name) for name in self.names])
        self.shown = self._choose_slots()
        self.stretch = slice(int(self.shown[0]), int(self.shown[-1]) + 1)

    @cached_property
    def scenario(self) -> Scenario:
        """Scenario that was run."""
        try:
            document = tomllib.loads(str(self.result.attrs["scenario"]))
            return checked(Scenario, document, "the result's scenario")
        except (KeyError, tomllib.TOMLDecodeError, ScenarioError) as error:
            raise PlotError(f"the result does not contain its scenario: {error}") from None

    @cached_property
    def parts(self) -> dict[str, Statistics]:
        """Statistics of every scheme."""
        self.check(*needed(self.scenario))
        self._check_whole()
        whole = result_statistics(self.result, self.scenario)
        return {name: of_scheme(whole, index) for index, name in enumerate(self.names)}

    @cached_property
    def looks(self) -> dict[str, Look]:
        """Look of every scheme."""
        return scheme_looks(self.names)

    @cached_property
    def genie_rates(self) -> Array | None:
        """Sum rates ``(trial, slot)`` of the genie, shown or not; None without one."""
        if GENIE not in self.whole["scheme"].values:
            return None
        one = self.whole[["rate", "present"]].sel(scheme=GENIE).transpose("trial", "slot", "object")
        return sum_rate(one["rate"].values, one["present"].values.astype(bool))

    @property
    def unlabelled(self) -> bool:
        """Whether the detections of the run had no labels, so that it has tracks of their own."""
        return self.scenario.unlabelled

    @property
    def trials(self) -> int:
        """Number of trials."""
        return int(self.result.sizes["trial"])

    @cached_property
    def slots(self) -> Array:
        """Numbers of the slots shown, ``(n,)``."""
        return np.asarray(self.result["slot"].values[self.shown], dtype=float)

    @property
    def frame(self) -> int:
        """Slots per frame; all slots of a selection that is not of complete frames."""
        frame, count = self.scenario.frame.slots_per_frame, self.slots.size
        number = (self.slots - 1.0) // frame
        return frame if (np.unique(number, return_counts=True)[1] == frame).all() else int(count)

    @property
    def pooled(self) -> int:
        """Slots per value of a curve: one, or a frame in long runs."""
        count = self.slots.size
        return self.frame if count > MOST_SLOTS and self.frame < count else 1

    def pool(self, values: Array) -> Array:
        """Return sums over the slots of each value shown, from those of all slots of the result."""
        values = values[..., self.shown]
        summed: Array = values.reshape(*values.shape[:-1], -1, self.pooled).sum(axis=-1)
        return summed

    @property
    def x(self) -> Array:
        """Positions of the curves' values on the axis of slots."""
        centres: Array = self.slots.reshape(-1, self.pooled).mean(axis=1)
        return centres

    def slot_axis(self) -> Axis:
        """Return the axis of slots, with a margin of half a slot at both ends."""
        words = f"{self.scenario.frame.slot * 1e3:g} ms each"
        return Axis("Slot", words, limits=(self.slots[0] - 0.5, self.slots[-1] + 0.5))

    def omni_guides(self) -> tuple[Guide, ...]:
        """Return the shaded slots without directional beams.

        Ignored are schemes that never send directional beams (omni), and slots in which trials
        differ.
        """
        self.check("phase")
        phase = self.result["phase"].transpose("scheme", "slot").values.astype(str)
        phase = phase[np.isin(phase, ["directional", "mixed"]).any(axis=1)]
        if self.pooled > 1 or not phase.size:
            return ()
        kinds = [kind for kind in ("omni", "pilot") if (phase == kind).any()]
        without = np.isin(phase[:, self.shown], kinds).any(axis=0)
        return shaded(self.slots[without], " or ".join(kinds) + " slot")

    def setting(self, scheme: str = "", *, one_trial: bool = False) -> str:
        """Return the scenario's values for the title: antennas, height, trials."""
        parts = [scheme] * bool(scheme) + [
            self._antennas(),
            f"$h$ = {self.scenario.uav.start(self.scenario.geometry)[2]:g} m",
            self._trial() if one_trial else f"{self.trials} trial{'s' * (self.trials != 1)}",
        ]
        if self.choice.slots and not one_trial:
            slots = [f"{slot:g}" for slot in self.slots]
            few = f"slot{'s' * (len(slots) > 1)} {', '.join(slots)}"
            parts.append(
                few if len(slots) < 4 else f"{len(slots)} slots from {slots[0]} to {slots[-1]}"
            )
        if self.pooled > 1 and not one_trial:
            parts.append(f"frames of {self.pooled} slots")
        return ", ".join(parts)

    @property
    def title(self) -> str:
        """Title that was chosen, or the scenario's name."""
        # A $ in a name would begin a formula.
        return self.choice.title or self.scenario.name.replace("$", r"\$")

    def one_scheme(self) -> str:
        """Return the scheme shown by a picture of a single scheme.

        It is the first chosen one, else temporal or its first variant, else the first with
        directional slots.
        """
        if self.choice.schemes:
            return self.choice.schemes[0]
        variants = [name for name in self.names if split(name)[0] == "temporal"]
        variants.sort(key=lambda name: name != "temporal")
        self.check("mode")
        beams = with_beams(self.result["mode"].transpose("scheme", ...).values)
        others = (name for name, some in zip(self.names, beams, strict=True) if some.any())
        return next(iter(variants), next(others, self.names[0]))

    def one_trial(self, *variables: str) -> xr.Dataset:
        """Return some variables of the chosen trial and scheme."""
        if not 0 <= self.choice.trial < self.trials:
            raise PlotError(
                f"the result holds no trial {self.choice.trial}; it holds 0 to {self.trials - 1}"
            )
        self.check(*variables)
        part = self.result[list(variables)].isel(trial=self.choice.trial)
        return part.isel(scheme=self.names.index(self.one_scheme()))

    def _check_whole(self) -> None:
        """Raise `PlotError` if objects of an unlabelled run are cut off."""
        found, count = self.result.sizes["object"], self.scenario.n_objects
        if self.unlabelled and found < count:
            raise PlotError(f"the result has {found} of {count} along object; expected all")

    def check(self, *variables: str) -> None:
        """Raise `PlotError` if the result lacks one of these variables."""
        missing = [name for name in variables if name not in self.result.variables]
        if missing:
            raise PlotError(f"the result holds no {', '.join(missing)}; is it from `echobeam run`?")

    def _antennas(self) -> str:
        """Return the size of the transmit array."""
        array = self.scenario.array
        if array.kind == "linear":
            return f"$N_t$ = {array.n_tx}"
        return rf"{array.rows} $\times$ {array.columns} elements"

    def _trial(self) -> str:
        """Return the trial's own number: a result may hold some chosen trials."""
        held = self.result["trial"].values
        if all(int(two) - int(one) == 1 for one, two in pairwise(held)):
            return f"trial {held[self.choice.trial]} of {held[0]} to {held[-1]}"
        return f"trial {held[self.choice.trial]}, one of {self.trials} chosen"

    def _choose_slots(self) -> IntArray:
        """Return the places of the chosen slots in the result."""
        numbers = [int(slot) for slot in self.result["slot"].values]
        unknown = [str(slot) for slot in self.choice.slots if slot not in numbers]
        if unknown:
            raise PlotError(
                f"the result holds no slot {', '.join(unknown)}; "
                f"it holds {numbers[0]} to {numbers[-1]}"
            )
        return np.flatnonzero(np.isin(numbers, self.choice.slots or numbers))


def shaded(slots: Array, name: str) -> tuple[Guide, ...]:
    """Return shaded bands, one for each spell of consecutive slots ``(n,)``, in order."""
    edges = np.flatnonzero(np.diff(slots, prepend=-np.inf) > 1)
    return tuple(
        Guide("x", float(spell[0]) - 0.5, float(spell[-1]) + 0.5, Look(SHADE), name)
        for spell in np.split(slots, edges[1:])
        if spell.size
    )


def empty_figure(source: Source, kind: str, why: str) -> FigureData:
    """Return an empty figure with the reason as its text."""
    panel = Panel(Axis(""), Axis(""), (), empty=why)
    return FigureData(kind, source.title, (panel,), source.setting())
