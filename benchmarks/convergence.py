"""Order of accuracy of the methods, measured with equal steps on systems whose solution is known.

    python benchmarks/convergence.py convergence.png

Prints the errors and the measured orders, and draws them. The continuous extension of Rodas4 has order 3: its
error in one step, and therefore over a run, falls with the fourth power of the step. The steps are
made equal by a tolerance that nothing exceeds, with ``first_step`` and ``max_step`` set to the step.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.integrate import Radau, solve_ivp

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "analytic"))
from analytic_systems import DrivenDecay, Duffing, TwoMassResonance

from hdsim.simulation.rosenbrock import Rodas4

LOOSE = 1e9  # a tolerance that no error exceeds


class ExactRadau(Radau):
    """Radau that solves its stages to rounding, however loose the error tolerance is."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.newton_tol = 1e-13 / LOOSE


CASES = [Duffing(), TwoMassResonance(), DrivenDecay()]
BETWEEN = "Rodas4 between steps"
ORDERS = {"Rodas4": 4, BETWEEN: 4, "RK45": 5, "Radau": 5}
STEPS = [25, 50, 100, 200, 400, 800, 1600]
# Below this, rounding and the Newton iterations of Radau show.
FLOOR = 1e-11


def error(case, method, steps):
    """Largest error over the run in units of the states' sizes; nan where the steps were not equal."""
    system = case.system()
    h = case.t_end / steps
    t = np.linspace(0.0, case.t_end, steps + 1)
    if method == BETWEEN:
        t = (t[:-1, None] + h * np.array([0.2, 0.5, 0.8])).ravel()
    options = {"rtol": LOOSE, "atol": LOOSE, "first_step": h, "max_step": h}
    if method == "Radau":
        options |= {"method": ExactRadau, "jac": system.jacobian}
    elif method == "RK45":
        options |= {"method": "RK45"}
    else:
        options |= {"method": Rodas4, "system": system, "steps_per_call": 1}
    found = solve_ivp(system.rhs, (0.0, case.t_end), system.y0, dense_output=True, **options)
    if len(found.t) not in (
        steps + 1,
        steps + 2,
    ):  # SciPy's methods can leave a crumb of rounding for the end
        return np.nan
    return (abs(found.sol(t) - case.exact(t)) / system.scale[:, None]).max()


def measured_order(errors):
    """Slope of log error over log step, over the last three errors above rounding."""
    good = [i for i, value in enumerate(errors) if value > FLOOR][-3:]
    return np.polyfit(np.log([1.0 / STEPS[i] for i in good]), np.log([errors[i] for i in good]), 1)[0]


def draw(results, path):
    """One panel a system: error over step, with the slope of each method's order."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, panels = pyplot.subplots(1, len(CASES), figsize=(13, 4.8), sharey=True, layout="constrained")
    styles = {"Rodas4": "o-", BETWEEN: "o--", "RK45": "s-", "Radau": "^-"}
    colours = {"Rodas4": "C0", BETWEEN: "C0", "RK45": "C1", "Radau": "C2"}
    for panel, case in zip(panels, CASES, strict=True):
        h = case.t_end / np.array(STEPS)
        for method, style in styles.items():
            errors = results[case.name][method]
            label = f"{method}: order {measured_order(errors):.2f}"
            panel.loglog(h, errors, style, color=colours[method], markersize=4, label=label)
        top = results[case.name]["Rodas4"][1]
        panel.loglog(h[1:6], 5 * top * (h[1:6] / h[1]) ** 4, "k:", linewidth=1, label="slope 4")
        panel.set_title(case.name)
        panel.set_xlabel("step (s)")
        panel.grid(alpha=0.3)
        panel.legend(fontsize=8, loc="upper left")
    panels[0].set_ylabel("largest error / size of the state")
    panels[0].set_ylim(1e-15, 1e2)
    figure.suptitle("Equal steps against the exact solution")
    figure.savefig(path, dpi=120)


def main():
    """Measure, print and draw."""
    if len(sys.argv) != 2:
        sys.exit("usage: python benchmarks/convergence.py FIGURE.png")
    results = {
        case.name: {method: [error(case, method, steps) for steps in STEPS] for method in ORDERS}
        for case in CASES
    }
    for name, methods in results.items():
        print(f"\n{name}: largest error for {', '.join(map(str, STEPS))} steps; order measured (expected)")
        for method, errors in methods.items():
            row = "  ".join(f"{value:8.1e}" for value in errors)
            print(f"  {method:21s} {row}   {measured_order(errors):5.2f} ({ORDERS[method]})")
    draw(results, sys.argv[1])


if __name__ == "__main__":
    main()
