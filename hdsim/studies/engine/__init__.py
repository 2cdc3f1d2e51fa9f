"""The study engine: which runs, on which machines, and what comes out of them all."""
