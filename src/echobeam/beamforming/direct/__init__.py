"""Direct solver on rank-one beams: `batch.solve_batch` designs the beams of a block of trials.

Read `batch` first, then `layout` and `climb`. `batch`, `layout`, `found` and `subsets` are plain
Python; all other files are compiled, into one function that `trials` calls.
"""

from echobeam.beamforming.direct.batch import LEAST_ANTENNAS, DirectResult, solve_batch

__all__ = ["LEAST_ANTENNAS", "DirectResult", "solve_batch"]
