"""Direct solver on beams of one or two columns: `batch.solve_batch` designs a block of trials.

Read `batch` first, then `layout` and `climb`. `batch`, `layout`, `found` and `subsets` are plain
Python; all other files are compiled, into one function that `trials` calls.
"""

from echobeam.beamforming.direct.batch import LEAST_ANTENNAS, DirectResult, solve_batch

__all__ = ["LEAST_ANTENNAS", "DirectResult", "solve_batch"]
