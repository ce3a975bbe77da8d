"""Association: which of a scan's unlabelled detections belongs to which track.

Read `pairs` first: the log odds of each pair are all that the other files know of a scan. They are
choices of what to do with the joint events:

`nearest`     the most probable one
`best`        the K most probable ones, in order (enumerated, or by `search`)
`hypotheses`  the most probable ones over a window of scans
`joint`       the marginal probabilities over all of them (`exact`, or `belief` if there are many)

`clusters` takes a scan apart into problems that do not compete, `prices` are what detections are
worth in the best event, and `moments` makes one Gaussian of a mixture. No file knows a filter: the
caller updates tracks with what comes back.
"""

from echobeam.tracking.association.best import k_best
from echobeam.tracking.association.hypotheses import (
    Growth,
    Hypotheses,
    first_hypotheses,
    grow,
    marginal,
)
from echobeam.tracking.association.joint import association_probabilities
from echobeam.tracking.association.moments import moment_matched
from echobeam.tracking.association.nearest import nearest
from echobeam.tracking.association.pairs import Pairs, pairs_of

__all__ = [
    "Growth",
    "Hypotheses",
    "Pairs",
    "association_probabilities",
    "first_hypotheses",
    "grow",
    "k_best",
    "marginal",
    "moment_matched",
    "nearest",
    "pairs_of",
]
