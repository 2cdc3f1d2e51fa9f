"""Studies: bench procedures on simulated drives, and what comes out of them."""
