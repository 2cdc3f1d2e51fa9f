"""The one kernel behind every signal: pieces in time, each a cubic, a sum of sines, a chirp or a triangle.

Packed parameters: ``n``, the value before the first piece, buckets a second, number of buckets, then four
tables of n numbers (start of the piece in s; first and last piece of the smooth run that it belongs to;
position of its record), the buckets, then the records: kind, followed by the numbers listed at each kind
below. Times in a record count from the piece's start. Buckets cut the time between the first and the last
start evenly; each holds the last piece that has started when it begins, one more number closes them: a piece
is found by looking between two neighbours, however many thousand knots a measured motion has.

The run is chosen by ``inside``, the piece within the run by ``time``: a solver that looks a little over
the end of its span sees the current run continued, and a span may cross joints without a jump.
"""

from __future__ import annotations

import math
from typing import Any

from hdsim.kernel import signal

CUBIC = 0  #: c0, c1, c2, c3: value sum c_k t^k
SINES = 1  #: offset, count, then (amplitude, rad/s, phase) each
LINEAR_CHIRP = 2  #: offset, amplitude, rad/s at the start, rad/s^2, phase
EXPONENTIAL_CHIRP = 3  #: offset, amplitude, rad/s at the start, growth rate in 1/s, phase
TRIANGLE = 4  #: offset, amplitude, frequency in Hz; rises from the offset

#: Numbers before the tables.
HEADER = 4


@signal
def pieces(time: float, inside: float, parameters: Any, values: Any) -> None:
    """Value and three derivatives at ``time`` of the smooth run that holds ``inside``."""
    n = int(parameters[0])
    if inside < parameters[HEADER]:
        values[0] = parameters[1]
        values[1] = 0.0
        values[2] = 0.0
        values[3] = 0.0
        return
    starts = HEADER
    bucket = int((time - parameters[starts]) * parameters[2])
    bucket = max(min(bucket, int(parameters[3]) - 1), 0)
    bucket += starts + 4 * n
    # One piece more on either side: rounding may have put the time into the neighbour.
    low = max(int(parameters[bucket]) - 1, 0)
    high = min(int(parameters[bucket + 1]) + 2, n)
    while high - low > 1:
        middle = (low + high) // 2
        if parameters[starts + middle] <= time:
            low = middle
        else:
            high = middle
    first = int(parameters[starts + n + low])
    last = int(parameters[starts + 2 * n + low])
    if inside < parameters[starts + first] or (last + 1 < n and inside >= parameters[starts + last + 1]):
        # The time is over the edge of the run that holds ``inside``.
        low = 0
        high = n
        while high - low > 1:
            middle = (low + high) // 2
            if parameters[starts + middle] <= inside:
                low = middle
            else:
                high = middle
        first = int(parameters[starts + n + low])
        last = int(parameters[starts + 2 * n + low])
        low = first if time < parameters[starts + first] else last
    start = parameters[starts + low]
    at = int(parameters[starts + 3 * n + low])
    kind = int(parameters[at])
    t = time - start
    if kind == CUBIC:
        c1 = parameters[at + 2]
        c2 = parameters[at + 3]
        c3 = parameters[at + 4]
        values[0] = parameters[at + 1] + t * (c1 + t * (c2 + t * c3))
        values[1] = c1 + t * (2.0 * c2 + t * 3.0 * c3)
        values[2] = 2.0 * c2 + 6.0 * c3 * t
        values[3] = 6.0 * c3
        return
    values[0] = parameters[at + 1]
    values[1] = 0.0
    values[2] = 0.0
    values[3] = 0.0
    if kind == SINES:
        for k in range(int(parameters[at + 2])):
            amplitude = parameters[at + 3 + 3 * k]
            omega = parameters[at + 4 + 3 * k]
            phi = omega * t + parameters[at + 5 + 3 * k]
            sine = amplitude * math.sin(phi)
            cosine = amplitude * math.cos(phi)
            values[0] += sine
            values[1] += omega * cosine
            values[2] -= omega * omega * sine
            values[3] -= omega * omega * omega * cosine
    elif kind == TRIANGLE:
        amplitude = parameters[at + 2]
        frequency = parameters[at + 3]
        half = math.floor(2.0 * frequency * (inside - start) + 0.5)
        if half % 2 != 0:
            amplitude = -amplitude
        values[0] += amplitude * (4.0 * frequency * t - 2.0 * half)
        values[1] = 4.0 * frequency * amplitude
    else:
        amplitude = parameters[at + 2]
        omega = parameters[at + 3]
        rate = parameters[at + 4]
        phi = parameters[at + 5]
        if kind == LINEAR_CHIRP:
            phi += t * (omega + 0.5 * rate * t)
            phi1 = omega + rate * t
            phi2 = rate
            phi3 = 0.0
        else:
            phi += omega * math.expm1(rate * t) / rate
            phi1 = omega * math.exp(rate * t)
            phi2 = rate * phi1
            phi3 = rate * phi2
        sine = amplitude * math.sin(phi)
        cosine = amplitude * math.cos(phi)
        values[0] += sine
        values[1] = cosine * phi1
        values[2] = cosine * phi2 - sine * phi1 * phi1
        values[3] = cosine * (phi3 - phi1 * phi1 * phi1) - 3.0 * sine * phi1 * phi2
