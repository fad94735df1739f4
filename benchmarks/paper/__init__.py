"""Reproduces Maini, Gonultas & Isler (2022).

"Online Coverage Planning for an Autonomous Weed Mowing Robot with Curvature Constraints".
"""
