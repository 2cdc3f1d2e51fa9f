"""A scenario's joint for other programs: FMU for co-simulation, MJCF for MuJoCo."""
