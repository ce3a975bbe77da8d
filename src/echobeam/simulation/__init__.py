"""Nature, the loop over slots, and runs of many trials."""
