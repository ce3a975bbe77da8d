"""Schemes: what the UAV knows and decides. Each one in its file, over the shared base."""
