"""Metabolic rate of a muscle by two published models; of muscles alone, without the rest of the body.

B. R. Umberger, J. R. Soc. Interface 7 (2010) 1329, after Umberger, Gerritsen and Martin, Comput. Methods Biomech.
Biomed. Eng. 6 (2003) 99; L. J. Bhargava, M. G. Pandy and F. C. Anderson, J. Biomech. 37 (2004) 81.
"""

from typing import NamedTuple

from ppafo.model.elementary import sine_and_cosine_of_turns
from ppafo.wearer.model.muscle import Fibre, Muscle, bell, force_at
from ppafo.wearer.model.reflexes import Stimulation
from ppafo.wearer.model.walker import Fibres, Muscles

DENSITY, TENSION = 1059.7, 0.25e6
"""Of muscle [kg/m^3], and its largest stress [Pa]: Umberger 2003."""

AEROBIC = 1.5
"""Factor on heats for work that lasts longer than seconds."""

LEAST_HEAT = 1.0
"""W/kg of muscle, which a muscle at rest gives off."""

FASTER = 2.5
"""Largest velocity of fast fibres over the slow fibres' largest velocity."""

ROOTS = 10


class Work(NamedTuple):
    """What a muscle does: stimulation and activation [-], length [optimum lengths], velocity [optimum lengths/s].

    Also the active force [largest forces], and what it were at this length, full activation and rest. Velocity is above
    0 while the muscle lengthens.
    """

    stimulation: float
    activation: float
    length: float
    velocity: float
    force: float
    isometric: float


def mass_of(muscle: Muscle) -> float:
    """Mass of a muscle [kg], from its largest force and its length."""
    return DENSITY * muscle.force * muscle.optimum / TENSION


def work_of(muscle: Muscle, fibre: Fibre, stimulation: float) -> Work:
    """What a muscle does at a stimulation [-]."""
    length, velocity = fibre.length / muscle.optimum, fibre.velocity / muscle.optimum
    isometric = bell(length)
    return Work(
        stimulation=stimulation,
        activation=fibre.activation,
        length=length,
        velocity=velocity,
        force=fibre.activation * isometric * force_at(velocity / muscle.velocity),
        isometric=isometric,
    )


def to_three_fifths(number: float) -> float:
    """A number [-] between 0.001 and 1 to 0.6, by Newton's fifth root from above, the same in all lanes."""
    # No library's power, as its last bits differ between processors; from above the iteration falls to the root surely.
    root = 1.0
    for _ in range(ROOTS):
        fourth = root * root * root * root
        root = 0.2 * (4.0 * root + number / fourth)
    return root * root * root


def umberger_2010(muscle: Muscle, work: Work) -> float:
    """Metabolic rate of a muscle [W]: heats of activation, maintenance and shortening, and work that is not negative.

    h_AM = 1.28 %FT + 25 W/kg; h_SL of slow fibres is 100 W/kg at most, of fast ones 153 W/kg at their largest velocity;
    of lengthening 0.3 times that of slow ones (2003: 4 times).
    """
    fast = 1.0 - muscle.slow
    excess = work.stimulation - work.activation
    # As published: the stimulation while it is above the activation, else the mean of both.
    active = work.stimulation if excess > 0.0 else work.stimulation - 0.5 * excess
    is_long = work.length > 1.0
    maintenance = (128.0 * fast + 25.0) * to_three_fifths(max(active, 0.001))
    maintenance = maintenance * (0.4 + 0.6 * work.isometric if is_long else 1.0)
    of_slow, of_fast = 100.0 * FASTER / muscle.velocity, 153.0 / muscle.velocity
    shortens = max(-work.velocity, 0.0)
    shortening = (min(of_slow * shortens, 100.0) * muscle.slow + of_fast * shortens * fast) * active * active
    lengthening = 0.3 * of_slow * max(work.velocity, 0.0) * active
    moving = (shortening + lengthening) * (work.isometric if is_long else 1.0)
    heat = max(AEROBIC * (maintenance + moving), LEAST_HEAT)
    return mass_of(muscle) * heat + muscle.force * muscle.optimum * work.force * shortens


def bhargava_2004(muscle: Muscle, work: Work) -> float:
    """Metabolic rate of a muscle [W]: heats of activation, maintenance and shortening, and work, negative too.

    Slow fibres are recruited by sin(pi u / 2), fast ones by 1 - cos(pi u / 2). The activation heat does not decay, and
    a muscle gains no energy.
    """
    sine, cosine = sine_and_cosine_of_turns(0.25 * work.stimulation)
    slow, fast = muscle.slow * sine, (1.0 - muscle.slow) * (1.0 - cosine)
    short = max(work.length, 0.5)
    # Straight pieces of the published curve: in proportion up to the optimum, to nothing at one and a half times it.
    at_length = short if short < 1.0 else max(3.0 - 2.0 * short, 0.0)
    heat = 40.0 * slow + 133.0 * fast + at_length * (74.0 * slow + 111.0 * fast)
    isometric = work.activation * work.isometric
    share = 0.157 * work.force if work.velocity > 0.0 else 0.16 * isometric + 0.18 * work.force
    moving = -(share + work.force) * work.velocity
    return max(mass_of(muscle) * heat + muscle.force * muscle.optimum * moving, 0.0)


class Rates(NamedTuple):
    """Metabolic rate [W] by both models."""

    umberger: float
    bhargava: float


def both(muscle: Muscle, fibre: Fibre, stimulation: float) -> Rates:
    """Metabolic rate of a muscle [W] by both models."""
    work = work_of(muscle, fibre, stimulation)
    return Rates(umberger_2010(muscle, work), bhargava_2004(muscle, work))


def rates_of_leg(muscles: Muscles, fibres: Fibres, given: Stimulation) -> Rates:
    """Metabolic rate [W] of the muscles of a leg by both models."""
    soleus = both(muscles.soleus, fibres.soleus, given.soleus)
    tibialis = both(muscles.tibialis, fibres.tibialis, given.tibialis)
    gastrocnemius = both(muscles.gastrocnemius, fibres.gastrocnemius, given.gastrocnemius)
    vastus = both(muscles.vastus, fibres.vastus, given.vastus)
    hamstring = both(muscles.hamstring, fibres.hamstring, given.hamstring)
    gluteus = both(muscles.gluteus, fibres.gluteus, given.gluteus)
    flexor = both(muscles.flexor, fibres.flexor, given.flexor)
    umberger = soleus.umberger + tibialis.umberger + gastrocnemius.umberger + vastus.umberger
    bhargava = soleus.bhargava + tibialis.bhargava + gastrocnemius.bhargava + vastus.bhargava
    return Rates(
        umberger + hamstring.umberger + gluteus.umberger + flexor.umberger,
        bhargava + hamstring.bhargava + gluteus.bhargava + flexor.bhargava,
    )
