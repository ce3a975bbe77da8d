"""Beams of the largest expected sum rate over a belief of each object's place.

Problem (38) asks for a rate at one predicted angle and adds a cover by hand, (38f). Here the angle
of object k is a random number, theta_k ~ N(mean, deviation^2), and the beams maximise

    sum_k E[ log2(1 + SINR_k(theta_k)) ]    with   sum_k |w_k|^2 = P_T,

so that the belief itself says how much to cover: a narrow one gives matched beams that heed the
interference, a wide one a flat beam. Only the marginal of each object matters, since the rate of
an object depends on its own place alone.

Read `design` first. `beliefs` is the input, `quadrature` turns expectations into sums, `places`
has the channels at the nodes in few coordinates, `objective` and `ascent` climb, `starts` says
from where, `floors` says what rate floors take that are to be met with a probability, and
`keeping` meets them.
"""
