"""The scheme `posterior` against the others on the same luck: the tables of docs/posterior.md.

    python benchmarks/posterior_scheme.py points      frame rates, 26 settings
    python benchmarks/posterior_scheme.py long        500 ms without arrivals
    python benchmarks/posterior_scheme.py arrivals    rate against detection delay, three frames
    python benchmarks/posterior_scheme.py errors      errors over the bound with known height

Every number is one over the genie's mean rate, which never spends an omnidirectional slot.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np
import xarray as xr

import echobeam as eb
from echobeam.plots.drawing import Picture, draw
from echobeam.plots.looks import BLUE, DASHED, PURPLE, VERMILION, Look
from echobeam.plots.record import Axis, FigureData, Panel, Series
from echobeam.simulation.ground_bound import ground_bound

COMPARED = (
    "genie",
    "temporal",
    "water-filling",
    "pilot",
    "pilot-needle",
    "pilot-predict",
    "posterior",
)

FRAMES = {
    "clocked": [("frame.slots_per_frame", n) for n in (5, 10, 20, 50)],
    "adaptive": [("arrival_rate", rate) for rate in (0.5, 1.0, 2.0, 5.0, 20.0)],
    "probing": [("arrival_rate", rate) for rate in (0.5, 1.0, 2.0, 5.0, 20.0)],
}
"""Frames with the parameter that is varied, and its values."""


def settings() -> Iterator[tuple[str, eb.Scenario]]:
    """Yield labels and scenarios of the comparison."""
    single = eb.load_scenario("paper-single")
    for angle in (45, 60, 75):
        start = {"objects.0.angle": f"{angle} deg"}
        for height in (80, 100, 120, 140):
            changed = single.replace({**start, "uav.height": f"{height} m"})
            yield f"one object, {angle} deg, {height} m, P_T = 1", changed
        for power in (0.3, 10, 100):
            label = f"one object, {angle} deg, 100 m, P_T = {power:g}"
            yield label, single.replace({**start, "radio.power": power})
    multi = eb.load_scenario("paper-multi")
    for power in (0.3, 1, 10, 100):
        changed = multi.replace({"radio.power": power, "coverage.min_rate": 0})
        yield f"paper-multi, no floors, P_T = {power:g}", changed
    yield "paper-multi, floors, P_T = 1", multi


def frame_rates(result: xr.Dataset) -> dict[str, np.ndarray]:
    """Return the mean sum rate over the slots of each trial, ``(trial,)`` by scheme."""
    rates = result["rate"].fillna(0.0).sum("object").mean("slot")
    return {str(name): rates.sel(scheme=name).values for name in rates["scheme"].values}


def shown(rates: np.ndarray, reference: float) -> str:
    """Return mean with the half-width of its 95 % interval, and 5 % quantile."""
    half = 1.96 * rates.std(ddof=1) / np.sqrt(rates.size)
    return (
        f"{rates.mean() / reference:.3f}({1e3 * half / reference:.0f})"
        f"/{np.quantile(rates, 0.05) / reference:.3f}"
    )


def points(trials: int, seed: int) -> None:
    """Print the frame rates of all settings."""
    for label, scenario in settings():
        floors = ["genie:floors=true"] if scenario.coverage.min_rate > 0 else []
        schemes = [*COMPARED, *floors]
        result = eb.simulate(scenario, schemes=schemes, trials=trials, seed=seed, jobs=1)
        rates = frame_rates(result)
        genie = float(rates["genie"].mean())
        slots = result["rate"].fillna(0.0).sum("object").transpose("scheme", "trial", "slot")
        best, own = slots.sel(scheme="genie").values, slots.sel(scheme="posterior").values
        with_omni = float(np.concatenate([own[:, :1], best[:, 1:]], axis=1).mean())
        words = [f"{name} {shown(one, genie)}" for name, one in rates.items()]
        print(label, *words, sep=" | ", end=" | ")
        print("posterior over a genie with the omni slot", shown(rates["posterior"], with_omni))


def long(trials: int, seed: int) -> None:
    """Print the rates over 500 ms."""
    schemes = [
        "genie",
        "genie:floors=true",
        "temporal",
        "water-filling",
        "posterior",
        "posterior:frame=clocked",
        "posterior:min_rate=0",
        "posterior:min_rate=0,frame=clocked",
        "posterior:beamer=matched",
        "posterior:min_rate=0,tracker=ekf",
    ]
    result = eb.simulate("paper-long", schemes=schemes, trials=trials, seed=seed, jobs=1)
    rates = frame_rates(result)
    for name, one in rates.items():
        print(name, shown(one, float(rates["genie"].mean())))


SHIFTS = (0.0, 0.02, 0.05, 0.08, 0.13)
"""Delays of all arrivals, s: those of the scenario fall on the clock of some frames."""


def arrivals(trials: int, seed: int) -> None:
    """Print rate and delay of the three frames over their parameter."""
    base = eb.load_scenario("arrivals")
    own = base.scheme_parameters.get("posterior", {})
    found: dict[str, list[tuple[float, float, float]]] = {}
    for frame, values in FRAMES.items():
        for key, value in values:
            scenario, text = base, f"posterior:frame={frame}"
            if key.startswith("frame."):
                frames = base.n_slots // int(value)
                scenario = base.replace({key: value, "frame.frames": frames})
            else:
                text += f",{key}={value}"
            text += "".join(f",{name}={given}" for name, given in own.items())
            parts, late = [], []
            for shift in SHIFTS:
                result = eb.simulate(
                    later(scenario, shift),
                    schemes=["genie", text],
                    trials=trials // len(SHIFTS),
                    seed=seed,
                    jobs=1,
                )
                each = frame_rates(result)
                parts.append(each[text] / each["genie"].mean())
                late.append(1e3 * found_after(result.sel(scheme=text)))
            rates, delays = np.concatenate(parts), np.concatenate(late)
            most = np.quantile(delays, 0.9, method="inverted_cdf")
            print(
                f"{frame} {key}={value:g}: rate {shown(rates, 1.0)}, "
                f"delay: median {np.median(delays):.0f} ms, 90 % {most:.0f} ms",
                flush=True,
            )
            half = 1.96 * float(rates.std(ddof=1)) / np.sqrt(rates.size)
            point = (float(np.median(delays)), float(rates.mean()), float(half))
            found.setdefault(frame, []).append(point)
    draw_curve(found).savefig(PICTURE)
    print(PICTURE)


PICTURE = "posterior-arrivals.png"
LOOKS = {
    "clocked": Look(BLUE, "o", "-"),
    "adaptive": Look(VERMILION, "s", DASHED),
    "probing": Look(PURPLE, "X", "-"),
}


def draw_curve(found: dict[str, list[tuple[float, float, float]]]) -> Picture:
    """Return the picture of rate against delay, from median delay, rate and its half-width."""
    series = []
    for frame, points in found.items():
        delay, rate, half = np.array(points).T
        band = np.stack([rate - half, rate + half], axis=-1)
        series.append(Series(frame, delay, rate, band, LOOKS[frame], kind="points"))
    panel = Panel(
        Axis("Median delay from arrival to track", "ms", limits=(0.0, None)),
        Axis("Mean rate over the genie's"),
        tuple(series),
    )
    data = FigureData(
        "arrivals", "Arrivals without labels", (panel,), "",
        size=(3.5, 2.6), band="95 % interval",
    )  # fmt: skip
    return draw(data)


def later(scenario: eb.Scenario, shift: float) -> eb.Scenario:
    """Return a scenario in which objects that arrive do so later, and leave later."""
    changes: dict[str, object] = {}
    for number, one in enumerate(scenario.objects):
        if one.appears > 0.0:
            changes[f"objects.{number}.appears"] = one.appears + shift
            if one.leaves is not None:
                changes[f"objects.{number}.leaves"] = one.leaves + shift
    return scenario.replace(changes) if shift else scenario


def found_after(run: xr.Dataset) -> np.ndarray:
    """Return the time from an object's arrival to its first confirmed track, s; inf if never.

    Objects that are there from the first slot are left out: any frame begins with a look.
    """
    present = run["present"].transpose("trial", "slot", "object").values
    about = run["track_object"].transpose("trial", "slot", "track").values
    confirmed = run["track_status"].transpose("trial", "slot", "track").values >= 2
    slot = float(run["time"][1] - run["time"][0])
    delays = []
    for column in range(present.shape[-1]):
        if present[0, 0, column]:
            continue
        begin = int(np.argmax(present[0, :, column]))
        found = ((about == column) & confirmed).any(axis=-1)[:, begin:]
        delays.append(np.where(found.any(axis=-1), slot * np.argmax(found, axis=-1), np.inf))
    return np.concatenate(delays)


def errors(trials: int, seed: int) -> None:
    """Print RMSE over bound by slot, with altitude errors drawn."""
    for height, angle in ((100, 60), (110, 45), (140, 75)):
        scenario = eb.load_scenario(
            "paper-single",
            {
                "uav.height": f"{height} m",
                "objects.0.angle": f"{angle} deg",
                "truth.altitude_errors": True,
            },
        )
        result = eb.simulate(scenario, schemes=["posterior"], trials=trials, seed=seed)
        bound = ground_bound(result, scenario, "posterior")[:, 0]
        off = (result["estimated"] - result["truth"]).isel(scheme=0, object=0)
        rmse = np.sqrt((off**2).mean("trial").transpose("slot", "state").values)
        for name, row, least in zip(
            ("angle", "distance", "velocity"), rmse.T, bound.T, strict=True
        ):
            print(f"{angle} deg, {height} m, {name}: RMSE / bound", np.round(row / least, 2))


PARTS = {"points": points, "long": long, "arrivals": arrivals, "errors": errors}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    PARTS[given.part](given.trials, given.seed)
