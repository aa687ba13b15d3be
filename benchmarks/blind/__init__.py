"""Blind cases: campaigns drawn by the truth simulator, diagnosed by the product, compared with the truth.

``python -m benchmarks.blind --cases 60 --seed 1`` draws, runs and prints; ``--show SEED`` tells of one case.
The drawing (``fixtures``) knows nothing of the diagnosis, and the diagnosis is given files only.
"""
