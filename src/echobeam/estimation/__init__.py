"""Gaussian filter algebra, its examination and its bound. It knows no beams and no motion."""
