"""How fast would a solenoid valve have to switch to track as well as a proportional one?

The paper compares one solenoid pair with one proportional valve. Here the switching rate of the pair and the gains of
the PID controller are varied, at a torque that the supply can hold, and error is drawn against gas. All runs take some
seconds; the picture goes to ``out/compare-controllers``.

What to see: faster switching mends the error of the pair, but not its gas, since each switching vents a chamber. Larger
gains mend the error of the proportional valve until the derivative part makes the loop unstable at 1 kHz.
"""

# %% The task: 4 N m, within reach of 50 psi_g
from pathlib import Path

import matplotlib.pyplot as plt

import ppafo

TASK = ["reference.level=4 N m"]
RATES = (10, 20, 40, 80, 160)  # Hz; the paper's valve switches at 20 Hz
GAINS = (0.5, 1.0, 2.0, 4.0)  # times the published gains

folder = Path("out") / "compare-controllers"
folder.mkdir(parents=True, exist_ok=True)


# %% Two families of scenarios
def solenoid(rate: int) -> ppafo.Scenario:
    """Return the task with a solenoid pair that decides and switches at ``rate`` [Hz]."""
    overrides = [f"controller.rate={rate} Hz", f"valve.switching_interval={1000 / rate} ms"]
    return ppafo.load_scenario("torque-task-solenoid", TASK + overrides)


def proportional(factor: float) -> ppafo.Scenario:
    """Return the task with all three PID gains multiplied by ``factor``."""
    gains = ppafo.load_scenario("torque-task-proportional").control.settings
    names = ("proportional_gain", "integral_gain", "derivative_gain")
    return ppafo.load_scenario(
        "torque-task-proportional", TASK + [f"controller.{name}={factor * gains[name]}" for name in names]
    )


# %% Run them all side by side
solenoids = ppafo.simulate_many([solenoid(rate) for rate in RATES])
proportionals = ppafo.simulate_many([proportional(factor) for factor in GAINS])


# %% Error against gas
def error_and_gas(results: list[ppafo.Result]) -> tuple[list[float], list[float]]:
    """Return RMS errors [N m] and amounts of gas [g]."""
    errors = [result.metrics["rms_error"].value for result in results]
    return errors, [result.metrics["gas_supplied"].value * 1e3 for result in results]


figure, axes = plt.subplots(figsize=(7, 5), layout="constrained")
families = (
    ("solenoid pair", solenoids, [f"{rate} Hz" for rate in RATES]),
    ("proportional, PID", proportionals, [f"gains x {factor:g}" for factor in GAINS]),
)
for label, results, marks in families:
    errors, gases = error_and_gas(results)
    axes.plot(gases, errors, "o", label=label)
    for mark, gas, error in zip(marks, gases, errors, strict=True):
        axes.annotate(mark, (gas, error), textcoords="offset points", xytext=(6, 4), fontsize=8)
        print(f"{label:<18} {mark:<11} RMS error {error:6.3f} N m, CO2 {gas:5.2f} g")
axes.set(xlabel="CO$_2$ taken (g)", ylabel="RMS torque error (N m)", xlim=(0, 5), ylim=(0, None))
axes.legend()
figure.savefig(folder / "error-against-gas.png", dpi=150)
print(f"written: {folder / 'error-against-gas.png'}")
