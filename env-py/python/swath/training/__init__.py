"""Training with stable-baselines3 and sb3-contrib, and what becomes of it.

| module | what it is |
|---|---|
| `config`, `keys` | what a training file says, checked once |
| `algorithms`, `networks`, `candidate_policy` | what is trained, and by which parameters |
| `environments`, `abreast`, `generators`, `checkpoint` | what a training's state consists of, and the state on disk |
| `folder`, `callback`, `run` | the training itself |
| `play`, `curve`, `times`, `table` | evaluation on held-out instances |
| `card`, `policy` | a model's file and the text beside it, and the policy loaded from them |
| `export` | a policy as the plain numbers that the agent `learned` reads |

Only names that need no optional package are imported here.
"""

from swath.training.config import Evaluation, TrainingConfig
from swath.training.curve import Curve
from swath.training.export import export_policy
from swath.training.play import evaluate_policy
from swath.training.policy import Policy, RandomPlayer, load_policy
from swath.training.run import train

__all__ = [
    "Curve",
    "Evaluation",
    "Policy",
    "RandomPlayer",
    "TrainingConfig",
    "evaluate_policy",
    "export_policy",
    "load_policy",
    "train",
]
