"""Files of results, and of the blocks of trials from which a result is joined."""
