"""Times of the slot decision, on the same problems for every method, with correctness beside."""
