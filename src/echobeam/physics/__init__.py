"""What nature does: arrays, transmissions, links, echoes, measurements, bounds and motion.

Pure functions of arrays with any leading axes; no function here knows a scheme, a filter or a
slot. An object that is absent has NaN for its state and gets NaN for whatever follows from it,
while the others' numbers stay as if it had never been there.
"""
