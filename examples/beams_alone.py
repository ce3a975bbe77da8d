"""Use the beam solver by itself: three users of a base station, known to a few degrees each.

No UAV, slots or filter: a problem goes in, beams and a certificate come out. The gain of each beam
may vary by no more than the ripple while its user is anywhere in its cover.

    python examples/beams_alone.py

writes beams_alone.png and prints what was proved.
"""

import numpy as np
from matplotlib.figure import Figure

import echobeam as eb

array = eb.LinearArray(32, axis="horizontal")
problem = eb.BeamProblem(
    angles=np.radians([50, 80, 125]),
    distances=[180, 90, 140],  # m
    coverage_halfwidths=np.radians([1, 4, 2]),  # how far off a user may be
    ripple=3,  # of the gain, which is 32 at most
    min_rate=[1.0, 0.5, 0.5],  # bit/s/Hz
    power=1e5,
    noise=1,
    array=array,
)
answer = eb.design_beams(problem, certify=True)
print(
    f"{answer.status}: {answer.objective:.4f} bit/s/Hz, no design exceeds {answer.upper_bound:.4f}"
)
print(f"largest relative violation of a constraint: {answer.max_violation.largest:.1e}")

angle = np.radians(np.linspace(30, 150, 2401))
figure = Figure(figsize=(7.2, 3.2), layout="constrained")
axes = figure.subplots()
for k, beam in enumerate(answer.beams):
    snr = array.pattern(beam, angle) / problem.noise / problem.distances[k] ** 2
    (line,) = axes.plot(np.degrees(angle), 10 * np.log10(snr), label=f"user {k + 1}")
    low, high = np.degrees(problem.angles[k] + np.array([-1, 1]) * problem.coverage_halfwidths[k])
    axes.axvspan(low, high, color=line.get_color(), alpha=0.15, linewidth=0)
axes.set(xlabel="Angle (degrees)", ylabel="SNR at the user's distance (dB)")
axes.set(xlim=(30, 150), ylim=(-20, 25))
axes.legend(title="shaded: cover", loc="upper right")
figure.savefig("beams_alone.png", dpi=150)
