"""The paper's figures and claims as records, and the one command that redraws and judges them."""
