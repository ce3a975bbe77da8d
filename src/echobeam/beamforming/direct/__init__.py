"""The direct solver on rank-one beams: `solve_batch` designs the beams of a block of trials."""

from echobeam.beamforming.direct.batch import DirectResult, solve_batch

__all__ = ["DirectResult", "solve_batch"]
