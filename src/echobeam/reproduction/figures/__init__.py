"""Figures of the paper, a file for each: its data from stored trials, and its picture."""
