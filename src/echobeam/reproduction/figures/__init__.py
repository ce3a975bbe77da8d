"""One file per figure of the paper: its data from stored trials, and its picture."""
