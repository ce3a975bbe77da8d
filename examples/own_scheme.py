"""Write a scheme of one's own, have it examined, and compare it with the built-in ones.

Its beams are as wide as the belief is uncertain: an object gets a matched beam of so many
antennas that the half-power width spans four standard deviations of the predicted angle. Frame,
filter and omnidirectional slots come for free.

    python examples/own_scheme.py [TRIALS]

writes own_scheme.png.
"""

import sys

import numpy as np

import echobeam as eb

trials = int(sys.argv[1]) if len(sys.argv) > 1 else 200


@eb.scheme("zoom")
def zoom(prior: eb.Tracks, view: eb.View) -> np.ndarray:
    """Return matched beams of equal power, as wide as the belief: (trials, objects, antennas)."""
    array = view.system.transmitter
    angle = np.where(prior.known, prior.mean[..., 0], 1.0)  # rad
    spread = np.sqrt(np.where(prior.known, prior.cov[..., 0, 0], 0.0)) * np.abs(np.cos(angle))
    count = np.clip(0.886 / array.spacing / (4 * spread + 1e-9), 1, array.n)
    shape = (np.arange(array.n) < np.round(count)[..., None]) & prior.known[..., None]
    power = view.system.radio.power / np.maximum(prior.known.sum(axis=-1), 1)  # of each object
    scale = np.sqrt(power[..., None] / np.maximum(shape.sum(axis=-1), 1))
    return np.asarray(scale[..., None] * shape * array.steering(angle))


eb.testing.check_scheme(zoom)  # power, causality, no look at the truth; raises if not
result = eb.simulate("paper-multi", [zoom, "temporal", "water-filling", "pilot"], trials=trials)
eb.plot(result, "rate", title="A scheme of one's own", out="own_scheme.png")
table = eb.summary(result)["value"].unstack("quantity")
print(table[["frame_rate_mean", "frame_rate_q05", "outage", "lost"]])
