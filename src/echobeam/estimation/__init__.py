"""Gaussian filter algebra, its examination and its bound, and metrics of tracks without labels.

Read `gaussian` first: it holds one step of a filter. `consistency` and `bound` examine its
covariances. Where tracks carry no labels, `matching` assigns them to objects, `set_distance`
(GOSPA, OSPA) measures a slot and `continuity` a run. Numbers of independent trials get their
`intervals`. The room knows no beams and no motion.
"""
