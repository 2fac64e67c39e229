"""The leg against an independent derivation, and its energy."""

import math

import numpy as np
import pytest

from ppafo.model import leg as pendulum
from ppafo.model.leg import LegParameters

SYMPY = "the derivation needs sympy"


def some_leg() -> LegParameters:
    return LegParameters(
        shank_length=0.46,
        shank_mass_centre=0.2,
        shank_mass=4.5,
        shank_inertia=0.1,
        foot_mass_centre=0.09,
        foot_mass=1.0,
        foot_inertia=0.001,
        body_mass=72.5,
        ankle_stiffness=0.0,
        ankle_rest_angle=math.pi / 2,
        ankle_damping=0.0,
        residual_share=0.0,
        keeps_gait=0.0,
        heel_lever=0.05,
        flat_heel_lever=0.05,
        heel_roll_angle=0.1,
        toe_lever=0.13,
        gravity=9.80665,
    )


def torques_needed(leg: LegParameters, state: dict[str, float]) -> tuple[float, float]:
    """M q'' + C q' + G [N m] of the package."""
    phi = state["phi"]
    alpha = phi - state["theta"] + math.pi / 2
    directions = math.sin(phi), math.cos(phi), math.sin(alpha), math.cos(alpha)
    shank = state["phi_rate"], state["phi_acceleration"]
    knee = state["forward"], state["up"]
    ankle = pendulum.torque_of_shank(pendulum.foot_load(leg), *directions, *shank, *knee)
    return (
        pendulum.torque_on_knee(leg, *directions, *shank, state["theta_rate"], state["theta_acceleration"], *knee),
        ankle + pendulum.foot_inertia_about_ankle(leg) * state["theta_acceleration"],
    )


def inertia(leg: LegParameters, theta: float) -> np.ndarray:
    """M [kg m^2]: what each acceleration alone needs of a leg without weight."""
    still = dict.fromkeys(("phi", "phi_rate", "theta_rate", "forward", "up"), 0.0) | {"theta": theta}
    accelerations = np.eye(2).tolist()
    return np.array(
        [
            torques_needed(leg._replace(gravity=0.0), still | {"phi_acceleration": phi, "theta_acceleration": ankle})
            for phi, ankle in accelerations
        ]
    )


@pytest.fixture(scope="module")
def derived():
    """Generalised torques by Kane's method, as a function of the state."""
    sympy = pytest.importorskip("sympy", reason=SYMPY)
    mechanics = pytest.importorskip("sympy.physics.mechanics", reason=SYMPY)
    leg = some_leg()
    phi, theta, x, y = mechanics.dynamicsymbols("phi theta x y")
    time = mechanics.dynamicsymbols._t
    ground = mechanics.ReferenceFrame("ground")
    origin = mechanics.Point("origin")
    origin.set_vel(ground, 0)
    knee = origin.locatenew("knee", x * ground.x + y * ground.y)
    shank_frame = ground.orientnew("shank", "Axis", [phi, ground.z])
    foot_frame = ground.orientnew("foot", "Axis", [phi - theta + sympy.pi / 2, ground.z])
    ankle = knee.locatenew("ankle", -leg.shank_length * shank_frame.y)
    shank_centre = knee.locatenew("shank_centre", -leg.shank_mass_centre * shank_frame.y)
    foot_centre = ankle.locatenew("foot_centre", leg.foot_mass_centre * foot_frame.x)
    bodies = []
    for name, centre, frame, mass, inertia in (
        ("shank", shank_centre, shank_frame, leg.shank_mass, leg.shank_inertia),
        ("foot", foot_centre, foot_frame, leg.foot_mass, leg.foot_inertia),
    ):
        centre.set_vel(ground, centre.pos_from(origin).dt(ground))
        tensor = (mechanics.inertia(frame, 0, 0, inertia), centre)
        body = mechanics.RigidBody(name, centre, frame, mass, tensor)
        body.potential_energy = mass * leg.gravity * centre.pos_from(origin).dot(ground.y)
        bodies.append(body)
    lagrangian = mechanics.Lagrangian(ground, *bodies)
    equations = [
        sympy.diff(sympy.diff(lagrangian, q.diff(time)), time) - sympy.diff(lagrangian, q) for q in (phi, theta)
    ]
    names = {
        "phi_acceleration": phi.diff(time, 2),
        "theta_acceleration": theta.diff(time, 2),
        "forward": x.diff(time, 2),
        "up": y.diff(time, 2),
        "phi_rate": phi.diff(time),
        "theta_rate": theta.diff(time),
        "x_rate": x.diff(time),
        "y_rate": y.diff(time),
        "phi": phi,
        "theta": theta,
    }
    symbols = {name: sympy.Symbol(name) for name in names}
    plain = [equation.subs([(names[name], symbols[name]) for name in names]) for equation in equations]
    function = sympy.lambdify(list(symbols.values()), plain)
    return lambda state: function(*[state[name] for name in names])


@pytest.mark.parametrize("seed", range(20))
def test_both_rows_agree_with_a_symbolic_derivation(derived, seed: int) -> None:
    chance = np.random.default_rng(seed)
    names = ("phi", "theta", "phi_rate", "theta_rate", "phi_acceleration", "theta_acceleration", "forward", "up")
    scales = (0.6, 0.6, 5.0, 8.0, 50.0, 80.0, 5.0, 5.0)
    state = {name: float(scale * chance.standard_normal()) for name, scale in zip(names, scales, strict=True)}
    state["theta"] += math.pi / 2
    state |= {"x_rate": float(chance.standard_normal()), "y_rate": float(chance.standard_normal())}
    assert torques_needed(some_leg(), state) == pytest.approx(derived(state), rel=1e-9, abs=1e-9)


def test_energy_is_conserved_without_friction_damping_and_input() -> None:
    from scipy.integrate import solve_ivp

    leg = some_leg()

    def slopes(_time: float, y: np.ndarray) -> list[float]:
        phi, theta, phi_rate, theta_rate = y
        rest = {"phi": phi, "theta": theta, "phi_rate": phi_rate, "theta_rate": theta_rate, "forward": 0.0, "up": 0.0}
        at_rest = torques_needed(leg, rest | {"phi_acceleration": 0.0, "theta_acceleration": 0.0})
        return [phi_rate, theta_rate, *np.linalg.solve(inertia(leg, theta), -np.array(at_rest))]

    def energy(y: np.ndarray) -> float:
        phi, theta, phi_rate, theta_rate = y
        alpha = phi - theta + math.pi / 2
        rates = np.array([phi_rate, theta_rate])
        moving = 0.5 * rates @ inertia(leg, theta) @ rates
        height = -(leg.shank_mass * leg.shank_mass_centre + leg.foot_mass * leg.shank_length) * math.cos(phi)
        height += leg.foot_mass * leg.foot_mass_centre * math.sin(alpha)
        return moving + leg.gravity * height

    start = np.array([0.9, 1.2, 0.5, -3.0])
    swing = solve_ivp(slopes, (0.0, 3.0), start, rtol=1e-10, atol=1e-12)
    energies = [energy(y) for y in swing.y.T]
    assert np.ptp(swing.y[1]) > 1.0
    assert max(energies) - min(energies) < 1e-7
