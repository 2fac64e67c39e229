"""Mistakes of record and set, planted by a simulator of another author: the set does not agree, and it is said why."""

import pytest

from ppafo.questions.validate.solve import in_words, verdict
from scripts.planted_disagreements import PLANTED, Planted, said_of

pytestmark = [pytest.mark.long, pytest.mark.thorough]


@pytest.mark.parametrize("planted", PLANTED, ids=lambda one: one.title)
def test_what_is_wrong_is_named(planted: Planted) -> None:
    found = said_of(planted, 5)
    assert not found.passes
    best = found.explanations.found[0]
    assert in_words(best).startswith(planted.named) or any(one.startswith(planted.named) for one in best.others)
    assert verdict(found).startswith(f"ppafo2011 does not agree: {best.in_words}")


@pytest.mark.parametrize("seed", range(6, 10))
def test_the_right_set_agrees(seed: int) -> None:
    found = said_of(Planted("nothing", ""), seed)
    assert found.passes
    assert verdict(found).endswith("nothing but noise is left")
