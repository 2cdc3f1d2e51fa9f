"""Every table, figure and printed number of the source paper, recomputed and judged.

Source: Zhang, Liu, Yang, Wang, Liu (2021), Study on gear contact stiffness and backlash of harmonic drive
based on fractal theory, doi:10.21203/rs.3.rs-652069/v1. Nothing here is stored but what the paper prints.
"""
