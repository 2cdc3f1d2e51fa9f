"""hdsim held against the world: printed, measured and independently computed values, row by row."""
