"""Gymnasium environments of the device: ``ppafo/TorqueTask-v0``, ``ppafo/StepAngle-v0`` and ``ppafo/Walk-v0``.

    import gymnasium
    import ppafo.gym

    one = gymnasium.make("ppafo/TorqueTask-v0")
    many = gymnasium.make_vec("ppafo/TorqueTask-v0", num_envs=4096)

Needs the extra ``gym``. Training of a controller with them: docs/how-to/export.md.
"""

try:
    import gymnasium
except ImportError as error:
    raise ImportError("ppafo.gym needs Gymnasium: pip install 'ppafo[gym]'") from error

TASKS = {"ppafo/TorqueTask-v0": "torque", "ppafo/StepAngle-v0": "angle", "ppafo/Walk-v0": "walk"}

for name, task in TASKS.items():
    gymnasium.register(
        name,
        entry_point="ppafo.gym.environments:PneumaticEnv",
        vector_entry_point="ppafo.gym.environments:PneumaticVectorEnv",
        kwargs={"task": task},
    )
