import pickle

import numpy as np
import pytest

import gmlc
from gmlc import _gmlc


def test_parameters_parts_and_measures(tin):
    assert list(tin.parameters) == ["r", "h"]
    r = tin.parameters["r"]
    assert (r.unit, r.default, r.lower, r.upper, r.doc) == ("mm", 20.0, 10.0, 60.0, "Radius.")
    assert tin.parts == ("wall", "lid", "base")
    assert tin.measures == {"width": "mm"}


def test_points_are_those_of_a_tin(tin):
    rng = np.random.default_rng(1)
    u, v = rng.random((2, 5, 7))
    points = tin(r="21mm", h=52.0).points("wall", u, v)
    assert points.shape == (5, 7, 3)
    assert np.allclose(np.hypot(points[..., 0], points[..., 1]), 21.0)
    assert points[..., 2].min() >= 0 and points[..., 2].max() <= 52


def test_jacobian_and_pullback_are_finite_differences(tin):
    rng = np.random.default_rng(2)
    u, v = rng.random((2, 40))
    x = np.array([20.5, 48.0])
    for part in tin.parts:
        jacobian = tin(x).jacobian(part, u, v)
        assert jacobian.shape == (40, 3, 2)
        step = 1e-5
        for k in range(2):
            ahead, behind = x.copy(), x.copy()
            ahead[k] += step
            behind[k] -= step
            difference = (tin(ahead).points(part, u, v) - tin(behind).points(part, u, v)) / (2 * step)
            assert np.allclose(jacobian[..., k], difference, atol=1e-7)
        cotangents = rng.standard_normal((40, 3))
        pulled = tin(x).pullback(part, u, v, cotangents)
        assert np.allclose(pulled, np.einsum("nc,nck->k", cotangents, jacobian))


def test_broadcasting_and_single_points(tin):
    at = tin()
    assert at.points("wall", 0.25, 0.5).shape == (3,)
    grid = at.points("wall", np.linspace(0, 1, 4)[:, None], np.linspace(0, 1, 3))
    assert grid.shape == (4, 3, 3)
    assert np.array_equal(grid[1, 2], at.points("wall", 1 / 3, 1.0))


def test_a_mesh_is_closed_and_has_the_volume_of_a_tin(tin):
    trimesh = pytest.importorskip("trimesh")
    mesh = tin(r=20.0, h=50.0).mesh(chord="0.01mm")
    assert isinstance(mesh.to_trimesh(), trimesh.Trimesh)
    corners = mesh.positions[mesh.triangles]
    volume = np.einsum("ni,ni->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert abs(abs(volume) / (np.pi * 20**2 * 50) - 1) < 2e-3
    assert set(mesh.part) == {0, 1, 2}


def test_errors_have_the_diagnostics(tmp_path):
    with pytest.raises(gmlc.ScriptError) as caught:
        gmlc.Model.from_source("model m { part a = sfere(1mm) }", name="bad.gml")
    assert "bad.gml:1:" in str(caught.value) and "sfere" in str(caught.value)
    with pytest.raises(gmlc.Error, match="no such file"):
        gmlc.Model.load(tmp_path / "absent.gml")


def test_wrong_arguments_are_named(tin):
    with pytest.raises(gmlc.Error, match="q"):
        tin(q=3)
    with pytest.raises(gmlc.Error, match="r"):
        tin(r="300mm")
    with pytest.raises(KeyError, match="rim"):
        tin().points("rim", 0.5, 0.5)
    with pytest.raises(ValueError, match="3 values"):
        tin([1.0, 2.0, 3.0])
    with pytest.raises(TypeError):
        tin([20.0, 50.0], r=3)


def test_models_travel_as_text(tin):
    again = pickle.loads(pickle.dumps(tin))
    assert again.sha256 == tin.sha256
    assert np.array_equal(again().points("lid", 0.3, 0.4), tin().points("lid", 0.3, 0.4))


def test_what_a_script_uses_travels_with_it(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "ring.gml").write_text("use std.surface (revolve)\nfn ring(r: length) = revolve(|t| (r, 5mm * t))\n")
    (tmp_path / "main.gml").write_text('use "parts/ring.gml" (ring)\nmodel m { param r: length = 9mm\npart a = ring(r) }\n')
    model = gmlc.Model.load(tmp_path / "main.gml")
    assert len(model.texts()) == 2
    again = pickle.loads(pickle.dumps(model))
    assert np.allclose(again().points("a", 0.2, 0.3), model().points("a", 0.2, 0.3))


def test_inputs(tmp_path):
    text = "use std.surface (plane)\nmodel m { input n: int = 2\nfor i in 0..n { part p = plane(3mm, 2mm) } }"
    try:
        model = gmlc.Model.from_source(text, inputs={"n": 3})
    except gmlc.ScriptError as error:
        pytest.skip(f"the script is none: {error}")
    assert len(model.parts) == 3


def test_models_show_themselves(tin):
    assert "tin" in repr(tin)
    page = tin._repr_html_()
    assert "<table>" in page and "Radius." in page and "wall" in page


def test_commands_in_one_process_do_what_each_says(tmp_path, capfd):
    for name in ("first", "second"):
        script = tmp_path / f"{name}.gml"
        script.write_text(f"model {name} {{ part ball = sphere(2mm) }}")
        assert _gmlc.command(["gmlc", "check", str(script)]) == 0
        assert f"model {name}" in capfd.readouterr().out
