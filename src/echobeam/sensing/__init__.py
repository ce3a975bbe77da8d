"""Processing of echoes: from the signal at the receive array to angle, delay and Doppler.

Read `chain` first: it finds echoes one after the other in a map over delay, Doppler and angle
(`compression`), compares them with their surroundings (`cfar`), refines them on the likelihood
(`refine`), and takes the angle from the likelihood too or from Capon's spectrum (`capon`). Every
function is batched over leading axes; nothing here knows what is true.
"""
