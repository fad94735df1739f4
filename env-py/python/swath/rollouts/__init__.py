"""Episodes of one policy, played on servers and kept in a folder that several workers may share.

| module | what it is |
|---|---|
| `sweep` | what is to be played, by whom, and which part of it |
| `trajectory` | one episode as a file |
| `store` | the folder: what is there already, what is written next |
| `merge` | the rows and trajectories of all shards as results and a dataset |
| `work` | the work itself |
"""

from swath.rollouts.work import Work, work

__all__ = ["Work", "work"]
