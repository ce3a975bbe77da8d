"""The relaxation of problem (38): semidefinite programmes in reduced coordinates, Eqs. (51)-(54).

Read `solver` first. `model` states the problem in few real coordinates, `shape` finds the best
shape of each beam alone, `sdp` climbs the joint problem, `floors` says which rate floors cannot be
met, and `recovery` turns covariances into beams (`rank_one`). All programmes go through `conic`.

For a linear array the relaxation is exact, so that it examines the direct solver; for a planar one
it is a bound.
"""
