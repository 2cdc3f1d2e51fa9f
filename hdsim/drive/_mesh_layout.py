"""What a mesh kernel is given and what it returns, by place (see ``hdsim.drive._mesh``)."""

# Result of a mesh kernel.
ENERGY = 0
GRADIENT = 1  # m, f, o
HESSIAN = 4  # mm, mf, mo, ff, fo, oo
MESH_TWIST = 10
TWIST = 11
ENGAGED = 12  # number of teeth that carry load
TWIST_M = 13  # of a lumped mesh: first derivatives of TWIST over motor and output
TWIST_O = 14
TWIST_2 = 15  # and second ones: mm, mo, oo
HELD_TORQUE = 18  # given to it, and left there: what is parallel to its spring, N m
RESULT_SIZE = 19

# Parameters of a toothed mesh: a header, then the arrays at their offsets.
TEETH = 0
GAIN = 1  # g
OUTPUT_SHARE = 2  # nu
INVERSE_RATIO = 3
LEVER = 4  # R
KIND = 5  # 0 window, 1 clearance
PLATEAU = 6  # angle where the window starts to fall
BORDER = 7  # angle where it has reached zero
CLEARANCE = 8
KAPPA = 9
CONTACT_STEP = 10
CONTACT_CELLS = 11
CONTACT_AT = 12
SPRING_STEP = 13
SPRING_CELLS = 14
SPRING_AT = 15
GAP_CELLS = 16
GAP_AT = 17
PITCH_ERROR_AT = 18
EXTRA_GAP = 19
LARGEST_PITCH_ERROR = 20
TABLE_TWIST_STEP = 21
TABLE_TWIST_NODES = 22
TABLE_ANGLE_NODES = 23
TABLE_AT = 24
TABLE_TWIST_START = 25
SMOOTHING = 26  # half-width of the dead-zone's rounded corners, m
CONSTANT_GAPS_AT = 27  # constant half-gaps of the teeth, twice over as the pitch errors; 0: none
ODD_COUNT = 28  # teeth that differ from the drawn ones; 0: none
ODD_AT = 29  # where they stand, ``PER_ODD`` numbers each
WAVES = 30  # of a lumped mesh's half-gap around the wave generator; 0: it is the same all round
WAVES_AT = 31  # where they stand, ``PER_WAVE`` numbers each: amplitude (rad at the output), a, b, phase
HEADER = 32
PER_WAVE = 4

# A tooth that differs, see ``hdsim.drive._odd_tooth``.
ODD_MEMBER = 0  # 0 of the flexspline, 1 of the circular spline
ODD_TOOTH = 1  # its number, from 0
ODD_SHARE = 2  # of it, between 0 and 1
ODD_SHIFT = 3  # out of its place along the normal, m
ODD_WIDENED = 4  # half-gap on top of its own, m
PER_ODD = 5
