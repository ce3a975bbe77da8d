"""Figures of synthetic results, as the tests of the pictures read them."""

from __future__ import annotations

import numpy as np

from echobeam.plots import Choice, figures
from echobeam.plots.drawing import draw


def figure_of(kind, result, **choice):
    """Return the record of one kind of picture."""
    return figures(result, [kind], Choice(**choice))[kind]


def series_of(panel, name):
    """Return the series of a panel that has a name, None if there is none."""
    return next((one for one in panel.series if one.name == name), None)


def named(data):
    """Return the texts of a drawn figure's legends."""
    drawn = draw(data)
    legends = [*drawn.legends, *(axes.get_legend() for axes in drawn.axes if axes.get_legend())]
    return [text.get_text() for legend in legends for text in legend.get_texts()]


def written(data):
    """Return all texts that stand in a drawn figure's panels."""
    return [text.get_text() for axes in draw(data).axes for text in axes.texts]


def spans(panel):
    """Return the ranges that are shaded in a panel."""
    return np.array([(guide.at, guide.to) for guide in panel.guides if guide.to is not None])
