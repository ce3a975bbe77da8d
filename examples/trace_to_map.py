"""Run vehicles of a SUMO trace and draw where on the road, and when, they are served how well.

    python examples/trace_to_map.py [TRIALS] [SECONDS] [TRACE]

TRACE is floating-car data or a CSV file; by default the one that the scenario `traffic` has.
Writes traffic.nc and trace_to_map.png.
"""

import sys

from matplotlib.figure import Figure

import echobeam as eb

given = dict(enumerate(sys.argv))
trials, seconds = int(given.get(1, 4)), float(given.get(2, 30))

settings = {"frame.slot": "50 ms", "frame.frames": round(2 * seconds)}  # frames of ten slots
result = eb.run(
    "traffic",
    schemes=["temporal", "pilot"],
    trials=trials,
    set=settings,
    trace=given.get(3),
    out="traffic.nc",
    force=True,
)
time = result["time"] + 0 * result["object"]  # (slot, object), s
place = result["position"].isel(trial=0).sel(axis="x")  # m; nature is the same in every trial
rate = result["rate"].mean("trial")  # bit/s/Hz

figure = Figure(figsize=(7.2, 3.4), layout="constrained")
panels = figure.subplots(1, 2, sharex=True, sharey=True)
for panel, scheme in zip(panels, result["scheme"].values, strict=True):
    shown = {"c": rate.sel(scheme=scheme), "vmin": 0.0, "vmax": float(rate.max())}
    points = panel.scatter(time, place, s=3, linewidths=0, **shown)
    panel.axhline(0, color="0.6", linewidth=0.8, zorder=0)  # the UAV hovers above
    panel.set(title=scheme, xlabel="Time (s)")
panels[0].set_ylabel("Position along the road (m)")
figure.colorbar(points, ax=panels, label="Rate (bit/s/Hz)")
figure.savefig("trace_to_map.png", dpi=150)
