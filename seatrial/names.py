"""The names that a campaign or the command line may choose from."""

from __future__ import annotations

MODELS = (
    "nomoto1", "nomoto2", "nomoto_nonlinear", "zhu2019", "blanke", "abkowitz", "abkowitz_perturbation",
    "cybership2", "zhao2021", "modulus", "linear", "taylor3", "taylor_modulus", "mmg", "auto",
)  # fmt: skip
ESTIMATORS = (
    "ls", "ridge", "weak_form", "lssvm", "eso_lssvm", "wls_svr", "rw_lssvr", "recursive_ls", "output_error",
    "auto",
)  # fmt: skip
OPTIMISERS = (
    "abc", "aco_r", "bsas", "absas", "pso", "ldwpso", "cv", "cmaes", "de", "multistart", "auto",
)  # fmt: skip
MANOEUVRES = ("straight", "zigzag", "circle", "spiral", "stopping", "random", "speed", "idle")
ROLES = ("identify", "validate")

#: Models whose forces come from where the actuators stand: these need positions.
GEOMETRIC_MODELS = ("modulus", "linear", "mmg")
