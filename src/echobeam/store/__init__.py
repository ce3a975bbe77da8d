"""Files: results, and the blocks that a run leaves on its way to one."""
