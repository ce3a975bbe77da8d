"""The direct solver compiled: the same algorithm, trial by trial, on small arrays in the cache."""
