"""Grids of scenarios: many runs on common random numbers, digested block by block."""
