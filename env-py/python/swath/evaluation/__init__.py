"""Agents run over many instances, and what can be said about them."""

from swath.evaluation.results import Results
from swath.evaluation.row import Row
from swath.evaluation.run import evaluate

__all__ = ["Results", "Row", "evaluate"]
