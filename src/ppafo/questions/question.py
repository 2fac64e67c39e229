"""What a result can do, for packages that know it by this module."""

from ppafo.answers.solved import Solved as Solved
