"""Models of motion and measurement, the filter on them, and the life of a track."""
