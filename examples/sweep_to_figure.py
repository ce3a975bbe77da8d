"""Draw a figure for a paper from a sweep: the mean rate over the number of antennas.

Transmit and receive array grow together and the ripple allowed to the beams follows, so that the
size of the array is all that changes. Every point meets the same random numbers.

    python examples/sweep_to_figure.py [TRIALS]

writes antennas.nc (all quantities), antennas.pdf (no title: a paper has a caption of its own),
antennas.png and antennas.csv (the numbers in the figure).
"""

import sys

import echobeam as eb

trials = int(sys.argv[1]) if len(sys.argv) > 1 else 200

grid = eb.sweep(
    "paper-single",
    {("array.n_tx", "array.n_rx"): [8, 12, 16, 24, 32, 48, 64]},
    schemes=["temporal", "pilot", "genie"],
    trials=trials,
    out="antennas.nc",
    force=True,
)
eb.plot(grid, captions=False, out="antennas.pdf")
eb.plot(grid, title="Mean rate over the size of both arrays", out="antennas.png")
eb.plot(grid, out="antennas.csv")

rate = grid["frame_rate_mean"]  # (array.n_tx, scheme), bit/s/Hz
share = rate.sel(scheme=["temporal", "pilot"]) / rate.sel(scheme="genie")
print("share of the rate of the genie, which knows the truth:")
print(share.to_pandas().round(2))
