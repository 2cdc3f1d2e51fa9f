"""hdsim: dynamics of harmonic drives, from the rough tooth flank to the log."""
