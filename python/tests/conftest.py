import pytest

import gmlc

TIN = """use std.surface (revolve, flip)

/// A closed tin.
model tin {
  /// Radius.
  param r: length in 10mm..60mm = 20mm
  /// Height.
  param h: length in 10mm..90mm = 50mm
  measure width tolerance 0.6mm = 2 * r
  part wall = revolve(|t| (r, h * t))
  part lid = flip(revolve(|t| (r * t, h)))
  part base = revolve(|t| (r * t, 0mm))
}
"""

#: Options of quick virtual scans.
QUICK = {"spacing": "2mm", "noise": "0.05mm", "outliers": 0}


@pytest.fixture(scope="session")
def tin() -> gmlc.Model:
    return gmlc.Model.from_source(TIN, name="tin.gml")


@pytest.fixture(scope="session")
def scan(tin: gmlc.Model) -> gmlc.Scan:
    return gmlc.scan(tin, r="20.3mm", h=50.4, seed=1, **QUICK)


@pytest.fixture(scope="session")
def fit(tin: gmlc.Model, scan: gmlc.Scan) -> gmlc.Fit:
    return gmlc.fit(tin, scan)


@pytest.fixture(scope="session")
def files(tin: gmlc.Model, tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Six scans of different tins."""
    folder = tmp_path_factory.mktemp("scans")
    paths = [str(folder / f"tin_{i}.ply") for i in range(6)]
    for i, path in enumerate(paths):
        gmlc.scan(tin, path, r=20 + 0.1 * i, h=50 - 0.2 * i, seed=i, **QUICK)
    return paths
