"""Grids of scenarios: many runs on common random numbers, reduced to statistics block by block."""
