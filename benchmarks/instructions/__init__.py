"""Counts instructions with callgrind: a gate that no busy machine disturbs, and a profile."""
