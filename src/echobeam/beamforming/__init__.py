"""The optimiser: problem (38) in, beams and a certificate out. It knows no slots."""
