"""Examination of beams and proofs of bounds.

Read `certificate` first: what a design keeps, evaluated on the antenna weights and the full grid.
`bounds` and `box_bound` evaluate dual functions, so that any multipliers prove something; none of
the three imports a solver. `branch` closes the gap by branch and bound, with multipliers from
`box_relaxation`. `proof` keeps a bound until somebody asks for it.
"""
