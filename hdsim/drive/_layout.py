"""Where the numbers of a drive's system stand: its integers, its reals and its scratch."""

# Integers of the system.
STATES = 0
OWN_STATES = 1
SIGNALS = 2
ELEMENTS = 3
TWISTS = 4
MESH_ADDRESS = 5
MESH_AT = 6
RING = 7
COLUMNS = 8
REALS = 9
SCRATCH = 10
INTEGERS = 11
STATE_OF = 12  # three: index of a coordinate's angle in y, or -1
SIGNAL_OF = 15  # three: column of the signal that prescribes a coordinate, or -1
ENERGIES = 18  # number of trailing energy states: 3 with the audit, 0 without
ACCOUNTS = 19  # of heat: 0 without the audit
HOUSING = 20  # column of the housing's angle in the inputs, or 0
GIVEN = 21  # 1: coordinates, kinematic error and mesh stand in the scratch, else 0
ON_SPRING = 22  # number of own states whose torque is parallel to the spring
ON_SPRING_AT = 23  # where their columns stand
LISTS = 24  # elements (address, parameters, own, account), twists and signals (address, parameters)
PER_ELEMENT = 4
PER_TWIST = 2
PER_SIGNAL = 2

RING_DYNAMIC = 0
RING_STATIC = 1
RING_ABSENT = 2
RIGID = 3

# Reals of the system; the kernels' parameters follow.
INSIDE = 0
INERTIA = 1  # three
INVERSE_RATIO = 4
GAIN = 5
OUTPUT_SHARE = 6
KAPPA = 7
LAMBDA = 8  # three
HOUSING_INERTIA = 11
PARAMETERS = 16

# Scratch, from its end of fixed size: found at the same place for every model.
S_ANGLES = 0
S_VELOCITIES = 3
S_ACCELERATIONS = 6
S_ERROR = 9
S_MESH = 16
S_TWIST_1 = 35  # first derivatives of the torsion twist over the three angles
S_MESH_1 = 38  # of the mesh twist
S_RING_1 = 41  # of the eliminated ring angle
S_KINETIC = 44
S_POTENTIAL = 45
S_CONSTRAINT = 46  # three: torque that the prescription of a coordinate costs
S_LEAST_HEAT = 49  # heat of the account that has least, if negative, W
S_LEAST_ACCOUNT = 50
S_HOUSING = 51  # angle and velocity
S_RELATIVE = 53  # three angles and three velocities as seen from the housing
S_SPARE = 59  # a mesh kernel's result beside the current angles
S_TWIST_2 = 78  # second derivatives (mm, mo, oo) of the torsion twist, with the Jacobian
S_MESH_2 = 81  # of the mesh twist
S_HELD = 84  # torque on the output of what is parallel to the spring, N m
S_INPUTS = 85  # then outputs, Jacobian, and the heat of each account
