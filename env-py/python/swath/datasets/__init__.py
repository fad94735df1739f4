"""Datasets of Minari, recorded straight from the native batch.

| module | what it is |
|---|---|
| `drivers` | who drives: scripted agents, trained policies, chance |
| `episodes` | whole episodes of a batch, one a row |
| `dataset` | the episodes as a dataset that Minari loads |
"""

from swath.datasets.dataset import record

__all__ = ["record"]
