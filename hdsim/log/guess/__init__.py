"""A mapping drafted from a file: what its names say, what its numbers show, and what stays open."""
