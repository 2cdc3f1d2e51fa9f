"""Figures of merit, each by its standard; importing this package registers them."""
