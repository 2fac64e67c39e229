"""Reflexes of a walking leg: stimulation of seven muscles from what the leg felt 5, 10 and 20 ms ago.

H. Geyer and H. Herr, IEEE Trans. Neural Syst. Rehabil. Eng. 18 (2010) 263: stance and swing have their own; forces are
in units of the muscle's largest, lengths in optimum lengths, loads in body weights.
"""

from typing import NamedTuple

LONG, MIDDLE, SHORT = 0.020, 0.010, 0.005
"""Delays [s] of the reflexes at ankle, knee and hip, there and back."""

LEAST = 0.01
"""Stimulation that no muscle falls below."""


class Felt(NamedTuple):
    """What a leg feels: of the ankle, of the knee, of the hip; each comes to the muscles after its own delay.

    Forces [largest forces], lengths [optimum lengths], knee [rad], [rad/s], load on the ground [body weights]; how fast
    the calf is stretched [optimum lengths/s], above 0 while it lengthens.
    """

    soleus: float
    gastrocnemius: float
    soleus_stretch: float
    gastrocnemius_stretch: float
    tibialis: float
    vastus: float
    knee: float
    knee_rate: float
    hamstring: float
    gluteus: float
    hamstring_length: float
    flexor_length: float
    load: float


class Balance(NamedTuple):
    """Lean of the trunk [rad], forward above 0, and its rate [rad/s]."""

    lean: float
    lean_rate: float


class Gait(NamedTuple):
    """Phase of a leg: 1 in stance, time since it touched the ground [s], lean of the trunk when it left it [rad]."""

    stands: float
    since: float
    lean_at_leaving: float


class Gains(NamedTuple):
    """Gains of the reflexes, in the units of ``Felt``; angles in rad. Names say which feeling drives which muscle.

    Stretch reflexes of the calf by its velocity, in stance and swing, are 0 in the publication: they make it spastic;
    K. Jansen et al., J. NeuroEng. Rehabil. 11 (2014) 78.
    """

    soleus_force: float
    gastrocnemius_force: float
    tibialis_length: float
    tibialis_rest: float
    soleus_on_tibialis: float
    vastus_force: float
    knee_stop: float
    knee_stop_angle: float
    load_on_vastus: float
    hamstring_force: float
    gluteus_force: float
    flexor_length: float
    flexor_rest: float
    hamstring_on_flexor: float
    hamstring_rest: float
    lean: float
    lean_rate: float
    lean_reference: float
    gluteus_share: float
    load_on_hip: float
    lean_at_leaving: float
    double_support: float
    tone: float
    tone_of_vastus: float
    tone_of_hip: float
    soleus_stretch: float
    gastrocnemius_stretch: float


class Stimulation(NamedTuple):
    """Stimulation [-] of the muscles of a leg, 0.01 to 1."""

    soleus: float
    tibialis: float
    gastrocnemius: float
    vastus: float
    hamstring: float
    gluteus: float
    flexor: float


def between(stimulation: float) -> float:
    """A stimulation within what a muscle can be given."""
    return min(max(stimulation, LEAST), 1.0)


def stimulation(
    gains: Gains, felt: Felt, balance: Balance, gait: Gait, other_load: float, trails: float
) -> Stimulation:
    """Stimulation of a leg; ``trails`` is 1 for the rear leg while both carry, ``other_load`` [body weights]."""
    stands = gait.stands > 0.5
    # The vasti are inhibited where the knee is nearly straight and still straightens: it would be overextended.
    straightens = felt.knee > gains.knee_stop_angle and felt.knee_rate > 0.0
    stop = gains.knee_stop * (felt.knee - gains.knee_stop_angle) if straightens else 0.0
    # Muscles of the hip balance the trunk, but only a leg that is loaded can: all is in proportion to the load.
    upright = gains.lean * (balance.lean - gains.lean_reference)
    turns = gains.lean_rate * balance.lean_rate
    load = gains.load_on_hip * felt.load
    rear = gains.double_support * trails
    tibialis = gains.tone + gains.tibialis_length * (felt.tibialis - gains.tibialis_rest)
    flexor = gains.tone_of_hip + gains.flexor_length * (felt.flexor_length - gains.flexor_rest)
    flexor += gains.lean_at_leaving * (gait.lean_at_leaving - gains.lean_reference)
    soleus = gains.tone + gains.soleus_stretch * max(felt.soleus_stretch, 0.0)
    gastrocnemius = gains.tone + gains.gastrocnemius_stretch * max(felt.gastrocnemius_stretch, 0.0)
    # A stretched hamstring ends the swing.
    flexor -= gains.hamstring_on_flexor * max(felt.hamstring_length - gains.hamstring_rest, 0.0)
    standing = Stimulation(
        soleus=soleus + gains.soleus_force * felt.soleus,
        tibialis=tibialis - gains.soleus_on_tibialis * felt.soleus,
        gastrocnemius=gastrocnemius + gains.gastrocnemius_force * felt.gastrocnemius,
        vastus=gains.tone_of_vastus
        + gains.vastus_force * felt.vastus
        - stop
        - gains.load_on_vastus * other_load * trails,
        hamstring=gains.tone_of_hip + max(upright + turns, 0.0) * load,
        gluteus=gains.tone_of_hip + max(gains.gluteus_share * upright + turns, 0.0) * load - rear,
        flexor=gains.tone_of_hip + max(-upright - turns, 0.0) * load + rear,
    )
    swinging = Stimulation(
        soleus=soleus,
        tibialis=tibialis,
        gastrocnemius=gastrocnemius,
        vastus=gains.tone,
        hamstring=gains.tone + gains.hamstring_force * felt.hamstring,
        gluteus=gains.tone + gains.gluteus_force * felt.gluteus,
        flexor=flexor,
    )
    return Stimulation(
        soleus=between(standing.soleus if stands else swinging.soleus),
        tibialis=between(standing.tibialis if stands else swinging.tibialis),
        gastrocnemius=between(standing.gastrocnemius if stands else swinging.gastrocnemius),
        vastus=between(standing.vastus if stands else swinging.vastus),
        hamstring=between(standing.hamstring if stands else swinging.hamstring),
        gluteus=between(standing.gluteus if stands else swinging.gluteus),
        flexor=between(standing.flexor if stands else swinging.flexor),
    )


def next_gait(gait: Gait, load: float, lean: float, step: float) -> Gait:
    """The phase of a leg after a step [s] at a load [body weights], as it is felt, and a lean of the trunk [rad]."""
    stands = load > 0.0
    touches, leaves = stands and gait.stands < 0.5, not stands and gait.stands > 0.5
    return Gait(
        stands=1.0 if stands else 0.0,
        since=0.0 if touches else gait.since + step,
        # Held through the swing: the more the trunk leaned as the leg left, the farther forward it has to step.
        lean_at_leaving=lean if leaves else gait.lean_at_leaving,
    )
