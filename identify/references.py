"""References in full: what models, effects and estimators give as their source by author and year."""

from __future__ import annotations

import re
from collections.abc import Iterable

REFERENCES = {
    "Abkowitz 1964":
        "Abkowitz, M. A., Lectures on Ship Hydrodynamics: Steering and Manoeuvrability. Hydro- and Aerodynamics "
        "Laboratory, Lyngby, Report Hy-5, 1964",
    "Blanke and Christensen 1993":
        "Blanke, M. and Christensen, A., Rudder-roll damping autopilot robustness to sway-yaw-roll couplings. Proc. "
        "10th Ship Control Systems Symposium, Ottawa, 1993",
    "Bock and Plitt 1984":
        "Bock, H. G. and Plitt, K. J., A multiple shooting algorithm for direct solution of optimal control problems."
        " Proc. 9th IFAC World Congress, Budapest, 1984",
    "Bryson and Frazier 1963":
        "Bryson, A. E. and Frazier, M., Smoothing for linear and nonlinear dynamic systems. Aeronautical Systems "
        "Division, Wright-Patterson AFB, TDR 63-119, 1963",
    "Carlton 2012": "Carlton, J. S., Marine Propellers and Propulsion, 3rd ed. Butterworth-Heinemann, 2012",
    "de Jong and Penzer 1998":
        "de Jong, P. and Penzer, J., Diagnosing shocks in time series. Journal of the American Statistical "
        "Association 93, 1998",
    "Fedyaevsky and Sobolev 1963":
        "Fedyaevsky, K. K. and Sobolev, G. V., Control and Stability in Ship Design. Sudpromgiz, Leningrad, 1963",
    "Fossen 2011": "Fossen, T. I., Handbook of Marine Craft Hydrodynamics and Motion Control. Wiley, 2011",
    "Golub et al. 1979":
        "Golub, G. H., Heath, M. and Wahba, G., Generalized cross-validation as a method for choosing a good ridge "
        "parameter. Technometrics 21, 1979",
    "Groves 2013":
        "Groves, P. D., Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed. Artech "
        "House, 2013",
    "Hoerl and Kennard 1970":
        "Hoerl, A. E. and Kennard, R. W., Ridge regression: biased estimation for nonorthogonal problems. "
        "Technometrics 12, 1970",
    "IMO MSC/Circ.1053":
        "International Maritime Organization, Explanatory Notes to the Standards for Ship Manoeuvrability. "
        "MSC/Circ.1053, 2002",
    "ITTC 7.5-02-06-04": "International Towing Tank Conference, Recommended Procedures and Guidelines, 7.5-02-06-04",
    "Ljung 1999": "Ljung, L., System Identification: Theory for the User, 2nd ed. Prentice Hall, 1999",
    "Moreno-Salinas et al. 2013":
        "Moreno-Salinas, D., Chaos, D., Besada-Portas, E., López-Orozco, J. A., de la Cruz, J. M. and Aranda, J., "
        "Semiphysical modelling of the nonlinear dynamics of a surface craft with LS-SVM. 2013",
    "Nomoto et al. 1957":
        "Nomoto, K., Taguchi, T., Honda, K. and Hirano, S., On the steering qualities of ships. International "
        "Shipbuilding Progress 4, 1957",
    "Norrbin 1963":
        "Norrbin, N. H., On the design and analysis of the zig-zag test on base of quasi-linear frequency response. "
        "Swedish State Shipbuilding Experimental Tank, Report B 104-3, 1963",
    "Skjetne et al. 2004":
        "Skjetne, R., Smogeli, Ø. N. and Fossen, T. I., A nonlinear ship manoeuvering model: identification and "
        "adaptive control with experiments for a model ship. Modeling, Identification and Control 25, 2004",
    "SOLAS II-1/29": "International Convention for the Safety of Life at Sea, chapter II-1, regulation 29",
    "Strom-Tejsen 1965":
        "Strøm-Tejsen, J., A digital computer technique for prediction of standard maneuvers of surface ships. David "
        "Taylor Model Basin, Report 2130, 1965",
    "Suykens and Vandewalle 1999":
        "Suykens, J. A. K. and Vandewalle, J., Least squares support vector machine classifiers. Neural Processing "
        "Letters 9, 1999",
    "Xie et al. 2020":
        "Xie, S., Garofano, V., Liu, C., Chu, X. and Negenborn, R. R., Ship motion modeling using an optimized "
        "extended state observer-least squares support vector machine. 2020",
    "Yasukawa and Yoshimura 2015":
        "Yasukawa, H. and Yoshimura, Y., Introduction of MMG standard method for ship maneuvering predictions. "
        "Journal of Marine Science and Technology 20, 2015",
    "Zhao and Li 2021":
        "Zhao, C. and Li, X., Parameters' identification of vessel based on ant colony optimization algorithm. 2021",
    "Zhu et al. 2019":
        "Zhu, M., Wen, Y., Sun, W. and Wu, B., A novel adaptive weighted least square support vector regression "
        "algorithm-based identification of the ship dynamic model. IEEE Access 7, 2019",
    "Zhu et al. 2022":
        "Zhu, M., Sun, W., Wen, Y. and Huang, L., Extended state observer-based parameter identification of response "
        "model for autonomous vessels. Journal of Marine Science and Engineering 10, 2022",
}  # fmt: skip

#: What the smoother rests on, and an output error over windows.
SMOOTHER = "Bryson and Frazier 1963; de Jong and Penzer 1998"
OUTPUT_ERROR = "Ljung 1999; Bock and Plitt 1984"


def in_full(sources: Iterable[str]) -> tuple[str, ...]:
    """References in full, each once, with the places in it in brackets; experience has none.

    Parameters
    ----------
    sources : iterable of str
        ``"Fossen 2011, sec. 8.3; IMO MSC/Circ.1053, 3.4.2.5"``, one or several at a time.
    """
    places: dict[str, list[str]] = {}
    for source in (part.strip() for s in sources for part in re.split("; ", s)):
        key = next((k for k in REFERENCES if source.startswith(k)), None)
        if key is not None:
            places.setdefault(key, []).append(source.removeprefix(key).removeprefix(", "))
        elif re.search(r"\d{4}", source):
            places.setdefault(source, [])
    return tuple(_with_places(key, list(dict.fromkeys(filter(None, found)))) for key, found in places.items())


def _with_places(key: str, found: list[str]) -> str:
    return REFERENCES.get(key, key) + (f" ({'; '.join(found)})." if found else ".")
