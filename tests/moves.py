"""A drive that moves its load to and fro, and rests between the moves."""

#: Between the moves the motor is held by its friction, and creeps to where it is to be.
MOVES = {
    "drive": {"preset": "csg-20-100", "mesh": {"model": "lumped"}},
    "command": {"motor": {
        "type": "position",
        "at": "output",
        "trajectory": {"type": "sequence", "moves": [
            move
            for distance_deg in (60, -90, 45, -15)
            for move in (
                {
                    "type": "s_curve",
                    "distance_deg": distance_deg,
                    "maximum_velocity_deg_per_s": 90,
                    "maximum_acceleration_deg_per_s2": 500,
                    "maximum_jerk_deg_per_s3": 8000,
                },
                {"type": "hold", "duration_s": 0.3},
            )
        ]},
        "controller": {
            "type": "cascade",
            "position_gain_per_s": 30,
            "velocity_gain_nm_s_per_rad": 0.025,
            "velocity_integral_gain_nm_per_rad": 0.5,
        },
    }},
    "load": {"inertia_kg_m2": 0.5},
    "run": {"duration_s": 6.0, "sample_rate_hz": 1000.0},
}  # fmt: skip
