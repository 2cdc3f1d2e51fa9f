"""Work against precision: every method on the seed drive, all 200 teeth, in a closed loop on a sine.

    python benchmarks/work_precision.py [-o FIGURE.png] [--quick]

Error: the largest of the relative root-mean-square errors of torsion twist, output torque and tracking error,
over samples at 2 kHz, against a reference at 1e-11 that a method of another family confirms. Cost: processor
time for a second of simulated time, median of the repeats, everything compiled beforehand. All methods get
the same states, samples and tolerances (absolute: relative times ``system.scale``). A tolerance means
something else to each method, so costs are compared at equal error, interpolated on logarithmic axes.

CVODE takes part if its Python interface is installed: ``pip install scikit-sundae``.
"""

import argparse
import math
import platform
import statistics
import time
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy_drive import NumpyDrive, disagreement
from scipy.integrate import solve_ivp

import hdsim
from hdsim.drive import _layout
from hdsim.simulation.rosenbrock import rodas4_through
from hdsim.simulation.setup import build_run
from hdsim.simulation.solvers import integrate

SCENARIO = Path(__file__).with_suffix(".yaml")
CHANNELS = ("twist", "output_torque", "tracking_error")
TARGETS = (1e-4, 1e-6)
SAMPLES_PER_S = 2000
DEFAULT = "rodas4 (hdsim's default)"
BARE = "rodas4 without SciPy"
PLAIN = "numpy, Radau"
CVODE = "CVODE (scikit-sundae)"


@dataclass
class Curve:
    """A method's costs and errors.

    Args:
        run: ``run(t_end, rtol, t_eval)`` integrates from the start and returns samples, shape (n, m).
        tolerances: relative tolerances, loosest first.
        share: part of the simulated time that a slow method runs; its cost grows in proportion, its error is
            that of this part.
    """

    run: object
    tolerances: list
    share: float = 1.0

    def measure(self, bench, most_repeats):
        """Time and judge every tolerance."""
        t_eval = bench.t_eval[bench.t_eval <= self.share * bench.t_end * (1 + 1e-12)]
        self.errors, self.costs, self.repeats = [], [], []
        for rtol in self.tolerances:
            seconds = []
            while not seconds or (len(seconds) < most_repeats and sum(seconds) < 1.0):
                start = time.process_time()
                y = self.run(t_eval[-1], rtol, t_eval)
                seconds.append(time.process_time() - start)
            self.errors.append(bench.error(y))
            self.costs.append(statistics.median(seconds) / t_eval[-1])
            self.repeats.append(len(seconds))

    def cost_at(self, error):
        """Cost at an error, and ``<`` where even the loosest run was better, nan where none was as good."""
        best = [i for i, value in enumerate(self.errors) if value == min(self.errors[: i + 1])]
        x, y = np.log([self.errors[i] for i in best]), np.log([self.costs[i] for i in best])
        if math.log(error) < x[-1]:
            return math.nan, ""
        if math.log(error) > x[0]:
            return math.exp(y[0]), "<"
        return math.exp(np.interp(-math.log(error), -x, y)), ""


class Bench:
    """The drive, its reference solution and the methods."""

    def __init__(self, quick):
        scenario = hdsim.load_scenario(SCENARIO)
        self.simulation = build_run(scenario)
        self.system = self.simulation.model.system
        self.y0 = self.simulation.y0
        # There and back; quick: only there. The motor passes its highest speed twice or once.
        self.t_end = 0.125 if quick else 0.25
        self.t_eval = np.linspace(0.0, self.t_end, round(self.t_end * SAMPLES_PER_S) + 1)
        self.system.reals[_layout.INSIDE] = 0.5 * self.t_end
        self.numpy = NumpyDrive(scenario, self.simulation.model)
        self.quick = quick

    def channels(self, y):
        """The compared quantities from samples (n, m): shape (3, m)."""
        times = self.t_eval[: y.shape[1]]
        inside = np.full(len(times), 0.5 * self.t_end)
        rows = self.simulation.observer.samples(times, y.T, inside)
        table = self.simulation.observer.state_table(times, y.T, inside, rows)
        return np.array([table[name] for name in CHANNELS])

    def error(self, y):
        """Worst relative root-mean-square error over the samples that there are."""
        found = self.channels(y)
        wanted = self.reference[:, : y.shape[1]]
        return np.sqrt(((found - wanted) ** 2).mean(axis=1) / (wanted**2).mean(axis=1)).max()

    def solve_reference(self):
        """Reference by the default method; returns how far the check by another family is from it."""
        self.reference = self.channels(self.bare(self.t_end, 1e-10 if self.quick else 1e-11, self.t_eval))
        method = self.cvode if find_spec("sksundae") else self.stock("DOP853")
        return self.error(method(self.t_end, 1e-10, self.t_eval))

    def tolerances(self, rtol):
        return {"rtol": rtol, "atol": rtol * self.system.scale}

    def default(self, t_end, rtol, t_eval):
        return integrate(self.system, 0.0, t_end, self.y0, rtol=rtol, t_eval=t_eval).y

    def bare(self, t_end, rtol, t_eval):
        cuts = np.array([0.0, t_end])
        return rodas4_through(self.system, cuts, self.y0, t_eval, **self.tolerances(rtol)).y

    def stock(self, method):
        """One of SciPy's methods with the compiled right-hand side and, if it takes one, Jacobian."""
        return lambda t_end, rtol, t_eval: (
            integrate(self.system, 0.0, t_end, self.y0, rtol=rtol, t_eval=t_eval, method=method).y
        )

    def plain(self, method):
        """One of SciPy's methods with nothing but the numpy right-hand side."""

        def run(t_end, rtol, t_eval):
            found = solve_ivp(
                self.numpy.rhs, (0.0, t_end), self.y0, method=method, t_eval=t_eval, **self.tolerances(rtol)
            )
            assert found.success, found.message
            return found.y

        return np.errstate(over="ignore")(run)  # SciPy's differences overflow for states that nothing reads

    def cvode(self, t_end, rtol, t_eval):
        """CVODE's BDF with the compiled right-hand side and Jacobian."""
        from sksundae import cvode

        def rhs(t, y, dy):
            dy[:] = self.system.rhs(t, y)

        def jacobian(t, y, dy, matrix):
            matrix[:] = self.system.jacobian(t, y)

        solver = cvode.CVODE(rhs, jacfn=jacobian, max_num_steps=10**8, **self.tolerances(rtol))
        found = solver.solve(t_eval, self.y0)
        assert found.success, found.message
        return np.asarray(found.y).T

    def curves(self):
        """All methods by name."""

        def steps(first, last, each=1):
            count = round((last - first) * each)
            return [10.0 ** -(first + k / each) for k in range(count + 1)]

        each = 1 if self.quick else 2
        found = {
            DEFAULT: Curve(self.default, steps(2, 7, 2)),
            BARE: Curve(self.bare, steps(2, 7, 2)),
            PLAIN: Curve(self.plain("Radau"), steps(2, 4, each) + ([] if self.quick else steps(5, 6))),
            "compiled, Radau": Curve(self.stock("Radau"), steps(2, 6, each)),
        }
        if find_spec("sksundae"):
            found[CVODE] = Curve(self.cvode, steps(3, 8, each))
        if not self.quick:
            found |= {
                "compiled, BDF": Curve(self.stock("BDF"), steps(4, 8)),
                "compiled, LSODA": Curve(self.stock("LSODA"), steps(4, 9)),
                "compiled, RK45": Curve(self.stock("RK45"), steps(3, 6), share=0.2),
                "compiled, DOP853": Curve(self.stock("DOP853"), steps(3, 6), share=0.2),
                "numpy, LSODA": Curve(self.plain("LSODA"), steps(5, 8), share=0.2),
                "numpy, BDF": Curve(self.plain("BDF"), steps(4, 7), share=0.2),
                "numpy, RK45": Curve(self.plain("RK45"), steps(3, 5, 1 / 2), share=0.1),
                "numpy, DOP853": Curve(self.plain("DOP853"), steps(3, 5, 1 / 2), share=0.1),
            }
        return found

    def print_sampling(self):
        """Where the default way spends its time beside the steps: observing, and SciPy's loop."""
        y = self.default(self.t_end, 1e-4, self.t_eval)
        times, inside = self.t_eval, np.full(len(self.t_eval), 0.5 * self.t_end)

        def observe():
            rows = self.simulation.observer.samples(times, y.T, inside)
            self.simulation.observer.state_table(times, y.T, inside, rows)

        seconds = []
        for _ in range(20):
            start = time.process_time()
            observe()
            seconds.append(time.process_time() - start)
        cost = statistics.median(seconds) / self.t_end
        rate = 1 / times[1]
        print(f"\nAll channels from states at {rate:.0f} samples/s: {1e3 * cost:.2f} ms per simulated second")


def draw(curves, path):
    """Error over cost of all methods."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(10, 5.5), layout="constrained")
    styles = {"rodas4": "o-", "compiled": "s-", "numpy": "^--", "CVODE": "D-"}
    for k, (name, curve) in enumerate(curves.items()):
        style = next(value for key, value in styles.items() if name.startswith(key))
        width = 2.5 if name == DEFAULT else 1.2
        axes.loglog(
            curve.costs, curve.errors, style, color=f"C{k % 10}", linewidth=width, markersize=5, label=name
        )
    axes.set_xlabel("processor time per simulated second (s)")
    axes.set_ylabel("worst relative RMS error of twist, output torque, tracking error")
    axes.set_title("Seed drive, 200 teeth, closed loop on a sine, motor up to 70 turns a second")
    axes.grid(which="both", alpha=0.25)
    figure.legend(loc="outside right upper", fontsize=9)
    figure.savefig(path, dpi=120)


def main():
    """Measure, print and draw."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("-o", "--output", type=Path, help="draw the curves into this file")
    options.add_argument("--quick", action="store_true", help="fewer methods and tolerances: under a minute")
    given = options.parse_args()

    bench = Bench(given.quick)
    teeth = bench.simulation.model.teeth.count
    print(f"{SCENARIO.name}: {bench.t_end:g} s, {teeth} teeth; Python {platform.python_version()}")
    worst = disagreement(bench.system, bench.numpy).max()
    print(f"numpy against compiled right-hand side: largest relative difference {worst:.1e}")
    assert worst < 1e-10
    print(f"reference against a method of another family: error {bench.solve_reference():.1e}")

    curves = bench.curves()
    for name, curve in curves.items():
        curve.measure(bench, most_repeats=3 if given.quick else 7)
        pairs = "  ".join(f"{e:.0e}/{c:.2g}" for e, c in zip(curve.errors, curve.costs, strict=True))
        print(f"  {name:26s} error/cost, {min(curve.repeats)}-{max(curve.repeats)} repeats: {pairs}")

    print(f"\n{'processor seconds per simulated second, and ratio to the default':>40s}")
    print(f"{'method':28s}" + "".join(f"{f'error {target:.0e}':>16s}{'ratio':>9s}" for target in TARGETS))
    for name, curve in curves.items():
        line = f"{name:28s}"
        for target in TARGETS:
            cost, mark = curve.cost_at(target)
            base, _ = curves[DEFAULT].cost_at(target)
            line += f"{f'{mark}{cost:.3g}':>16s}{cost / base:>9.3g}"
        print(line)
    print("<: cost of the loosest run, whose error is smaller already; nan: no run was as good")
    bench.print_sampling()
    if given.output:
        draw(curves, given.output)


if __name__ == "__main__":
    main()
