"""What the page on learning a controller shows runs as it stands there, and its example trains."""

import importlib
import re
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from ppafo.model.sensors import Measurement

gymnasium = pytest.importorskip("gymnasium")

from ppafo.worlds.gym.environments import DEFAULTS  # noqa: E402

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "how-to" / "learn-a-controller.md").read_text(encoding="utf-8")


@pytest.fixture
def example(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> ModuleType:
    """The example with a budget of nearly nothing, on the task whose model other tests have compiled."""
    monkeypatch.syspath_prepend(ROOT / "src" / "ppafo" / "examples" / "learn-a-controller")
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module("learn_a_controller")
    small = {"GENERATIONS": 2, "PAIRS": 2, "EPISODES": 2, "SECONDS": 0.02}
    small |= dict(zip(("SCENARIO", "HARDWARE"), DEFAULTS["torque"], strict=True))
    for name, value in small.items():
        monkeypatch.setattr(module, name, value)
    return module


def test_first_lines_of_the_page_run(capsys: pytest.CaptureFixture[str]) -> None:
    first = re.findall(r"^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)[0]
    exec(first, {})
    assert "supplied_mass" in capsys.readouterr().out


def test_the_example_trains_and_its_seed_fixes_what_comes_out(example: ModuleType) -> None:
    (weights, history), (again, _) = example.train(), example.train()
    assert len(history) == 2
    assert np.array_equal(weights, again)
    assert np.isfinite(weights).all()


def test_the_net_of_the_training_is_the_law_of_the_league(example: ModuleType) -> None:
    law = example.learnt_policy
    weights = np.random.default_rng(1).standard_normal(law.WEIGHTS)
    states = [law.KIND.initial, law.PolicyState(*np.zeros((5, 2)))]
    for sample in range(20):
        shown = Measurement(angle=1.4 + 0.01 * sample, pressure_1=2.0e5, pressure_2=1.5e5, torque=0.1 * sample)
        many = Measurement(*(np.full(2, value) for value in shown))
        command, states[0] = law.update(law.PolicyParameters(tuple(weights.tolist())), states[0], 2.0, shown, 1.0e-3)
        inputs, after = law.inputs_of(states[1], 2.0, many, 1.0e-3)
        given = np.clip(law.output_of(np.repeat(weights[:, None], 2, axis=1), inputs), -1.0, 1.0)
        states[1] = after._replace(command=given)
        assert given.tolist() == [command, command]
    assert -1.0 < command < 1.0
