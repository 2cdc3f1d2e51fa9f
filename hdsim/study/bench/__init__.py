"""Bench procedures: scenario, metrics and picture; importing this package registers them."""
