"""gmlc: generative models, fitted to laser scans and compared with them.

>>> import gmlc
>>> model = gmlc.Model.load("cup.gml")
>>> fit = gmlc.fit(model, "scan.ply")
>>> fit["r"].value, fit["r"].sd
>>> deviations = gmlc.deviations(fit, "scan.ply", tolerance="0.2mm")

Lengths are in millimetres and angles in radians, unless a text says another unit (``"2in"``, ``"30deg"``). Options are
those of the command ``gmlc`` with underscores instead of dashes: ``gmlc.fit(model, scan, loss="huber", unit="m")``.
"""

import os as _os

# A layer of Vulkan's prints an error on machines without a display, unless it is told that there is nothing to choose
# there: gmlc chooses the graphics card itself.
if not {"XDG_RUNTIME_DIR", "MESA_VK_DEVICE_SELECT"} & _os.environ.keys():
    _os.environ["NODEVICE_SELECT"] = "1"

from ._dask import batch_jobs, batch_work
from ._fit import Fit, Parameter, deviations, fit, inspect, Deviations, Inspection
from ._gmlc import Error, FitError, Interrupted, ScriptError, UsageError
from ._gmlc import VERSION as __version__
from ._many import Outcome, fit_many
from ._model import At, Mesh, Model
from ._scans import Scan, read_scan, scan

__all__ = [
    "At",
    "Deviations",
    "Error",
    "Fit",
    "FitError",
    "Inspection",
    "Interrupted",
    "Mesh",
    "Model",
    "Outcome",
    "Parameter",
    "Scan",
    "ScriptError",
    "UsageError",
    "__version__",
    "batch_jobs",
    "batch_work",
    "deviations",
    "fit",
    "fit_many",
    "inspect",
    "read_scan",
    "scan",
]
