"""Claims of the paper with a number or an ordering, each with its measure and its rule."""
