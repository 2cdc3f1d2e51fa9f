"""Live: a run while it is simulated, or a finished log, served to viewers of the Foxglove family."""
