"""What a wearer has felt and is still on its way: each feeling reaches the muscles 20, 10 or 5 ms after it was felt.

Nerves are sampled every ``SAMPLE``; what is on its way is a row of the last samples, the latest first. A hundred and
sixty numbers a leg, but they move along one place in ten steps only.
"""

from typing import Annotated, NamedTuple

from ppafo.wearer.model.reflexes import Balance, Felt

SAMPLE = 1.0e-3
"""Time [s] between two samples of the nerves."""

FAR, MIDDLE, NEAR = 20, 10, 5
"""Samples on the way from ankle, knee and hip: ``reflexes.LONG``, ``MIDDLE`` and ``SHORT``."""


class LegNerves(NamedTuple):
    """What a leg felt in the last samples, the latest first, in the units of ``Felt``."""

    soleus: Annotated[tuple[float, ...], FAR]
    gastrocnemius: Annotated[tuple[float, ...], FAR]
    soleus_stretch: Annotated[tuple[float, ...], FAR]
    gastrocnemius_stretch: Annotated[tuple[float, ...], FAR]
    tibialis: Annotated[tuple[float, ...], FAR]
    vastus: Annotated[tuple[float, ...], MIDDLE]
    knee: Annotated[tuple[float, ...], MIDDLE]
    knee_rate: Annotated[tuple[float, ...], MIDDLE]
    hamstring: Annotated[tuple[float, ...], NEAR]
    gluteus: Annotated[tuple[float, ...], NEAR]
    hamstring_length: Annotated[tuple[float, ...], NEAR]
    flexor_length: Annotated[tuple[float, ...], NEAR]
    load: Annotated[tuple[float, ...], NEAR]


class Nerves(NamedTuple):
    """What is on its way to the muscles of both legs: of the legs, and lean [rad] and its rate [rad/s] of the trunk."""

    left: LegNerves
    right: LegNerves
    lean: Annotated[tuple[float, ...], NEAR]
    lean_rate: Annotated[tuple[float, ...], NEAR]


def after_20(way: tuple[float, ...], felt: float) -> tuple[float, ...]:
    """The last 20 samples with a new one."""
    first = (felt, way[0], way[1], way[2], way[3], way[4], way[5], way[6], way[7], way[8])
    return (
        first[0],
        first[1],
        first[2],
        first[3],
        first[4],
        first[5],
        first[6],
        first[7],
        first[8],
        first[9],
        way[9],
        way[10],
        way[11],
        way[12],
        way[13],
        way[14],
        way[15],
        way[16],
        way[17],
        way[18],
    )


def after_10(way: tuple[float, ...], felt: float) -> tuple[float, ...]:
    """The last 10 samples with a new one."""
    return (felt, way[0], way[1], way[2], way[3], way[4], way[5], way[6], way[7], way[8])


def after_5(way: tuple[float, ...], felt: float) -> tuple[float, ...]:
    """The last 5 samples with a new one."""
    return (felt, way[0], way[1], way[2], way[3])


def arrived(nerves: LegNerves) -> Felt:
    """What a leg felt that reaches the muscles now."""
    return Felt(
        soleus=nerves.soleus[19],
        gastrocnemius=nerves.gastrocnemius[19],
        soleus_stretch=nerves.soleus_stretch[19],
        gastrocnemius_stretch=nerves.gastrocnemius_stretch[19],
        tibialis=nerves.tibialis[19],
        vastus=nerves.vastus[9],
        knee=nerves.knee[9],
        knee_rate=nerves.knee_rate[9],
        hamstring=nerves.hamstring[4],
        gluteus=nerves.gluteus[4],
        hamstring_length=nerves.hamstring_length[4],
        flexor_length=nerves.flexor_length[4],
        load=nerves.load[4],
    )


def balance_arrived(nerves: Nerves) -> Balance:
    """The balance of the trunk that reaches the muscles now."""
    return Balance(nerves.lean[4], nerves.lean_rate[4])


def next_of_leg(nerves: LegNerves, felt: Felt) -> LegNerves:
    """The nerves of a leg after a sample of what it feels."""
    return LegNerves(
        soleus=after_20(nerves.soleus, felt.soleus),
        gastrocnemius=after_20(nerves.gastrocnemius, felt.gastrocnemius),
        soleus_stretch=after_20(nerves.soleus_stretch, felt.soleus_stretch),
        gastrocnemius_stretch=after_20(nerves.gastrocnemius_stretch, felt.gastrocnemius_stretch),
        tibialis=after_20(nerves.tibialis, felt.tibialis),
        vastus=after_10(nerves.vastus, felt.vastus),
        knee=after_10(nerves.knee, felt.knee),
        knee_rate=after_10(nerves.knee_rate, felt.knee_rate),
        hamstring=after_5(nerves.hamstring, felt.hamstring),
        gluteus=after_5(nerves.gluteus, felt.gluteus),
        hamstring_length=after_5(nerves.hamstring_length, felt.hamstring_length),
        flexor_length=after_5(nerves.flexor_length, felt.flexor_length),
        load=after_5(nerves.load, felt.load),
    )


def next_nerves(nerves: Nerves, left: Felt, right: Felt, balance: Balance) -> Nerves:
    """All nerves after a sample of what legs and trunk feel."""
    return Nerves(
        left=next_of_leg(nerves.left, left),
        right=next_of_leg(nerves.right, right),
        lean=after_5(nerves.lean, balance.lean),
        lean_rate=after_5(nerves.lean_rate, balance.lean_rate),
    )


def settled_leg(felt: Felt) -> LegNerves:
    """The nerves of a leg that has felt the same for long."""
    return LegNerves(
        soleus=(felt.soleus,) * FAR,
        gastrocnemius=(felt.gastrocnemius,) * FAR,
        soleus_stretch=(felt.soleus_stretch,) * FAR,
        gastrocnemius_stretch=(felt.gastrocnemius_stretch,) * FAR,
        tibialis=(felt.tibialis,) * FAR,
        vastus=(felt.vastus,) * MIDDLE,
        knee=(felt.knee,) * MIDDLE,
        knee_rate=(felt.knee_rate,) * MIDDLE,
        hamstring=(felt.hamstring,) * NEAR,
        gluteus=(felt.gluteus,) * NEAR,
        hamstring_length=(felt.hamstring_length,) * NEAR,
        flexor_length=(felt.flexor_length,) * NEAR,
        load=(felt.load,) * NEAR,
    )


def settled_nerves(left: Felt, right: Felt, balance: Balance) -> Nerves:
    """The nerves of a wearer who has felt the same for long."""
    return Nerves(
        left=settled_leg(left),
        right=settled_leg(right),
        lean=(balance.lean,) * NEAR,
        lean_rate=(balance.lean_rate,) * NEAR,
    )
