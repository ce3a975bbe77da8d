"""Figures and claims of the paper as records, and the command that reproduces and judges them."""
