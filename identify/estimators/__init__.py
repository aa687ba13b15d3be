"""Regression estimators: a design and a target in, an estimate with its covariance out."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from .estimate import Estimate, Estimator, KernelMachine, Settings
from .kernels import predict
from .linear import fit_ls, fit_ridge
from .lssvm import fit_eso_lssvm, fit_lssvm
from .recursive import fit_recursive_ls
from .weighted import fit_rw_lssvr, fit_wls_svr

_REGULARISATION = {"C": (1e-2, 1e10)}
_WITH_BIAS = {**_REGULARISATION, "C_b": (1e-6, 1e6)}

ALL = (
    Estimator("ls", fit_ls),
    Estimator("ridge", fit_ridge, {"penalty": (1e-14, 1e2)}, "Hoerl and Kennard 1970; Golub et al. 1979"),
    Estimator("lssvm", fit_lssvm, _REGULARISATION, "Suykens and Vandewalle 1999", bias=True),
    Estimator("eso_lssvm", fit_eso_lssvm, _WITH_BIAS, "Xie et al. 2020, eq. 25-28", bias=True),
    Estimator("wls_svr", fit_wls_svr, _REGULARISATION, "Zhu et al. 2019, eq. 19-24", bias=True),
    Estimator("rw_lssvr", fit_rw_lssvr, _REGULARISATION, "Zhu et al. 2019; Zhu et al. 2022", bias=True),
    Estimator("recursive_ls", fit_recursive_ls, {"forgetting": (0.9, 1.0)}),
)
ESTIMATORS: Mapping[str, Estimator] = MappingProxyType({e.name: e for e in ALL})

__all__ = ["ESTIMATORS", "Estimate", "Estimator", "KernelMachine", "Settings", "predict"]
