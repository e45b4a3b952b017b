"""Figures of studies: the kind that suits the axes, every design in its place, failures seen."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from matplotlib.collections import LineCollection, QuadMesh

from zwidth.measures import FAILED, NO_VALUE, OK, OUT_OF_REACH, STATUS
from zwidth.show import save
from zwidth.show.figures.study import _in_lines, study_figure

LENGTHS, PERIODS, NAMES = np.linspace(0.1, 0.2, 5), np.geomspace(1e-4, 1e-2, 4), ["out", "in", "left"]
KEYS = {"length_m": ("length_m", LENGTHS, "m", "linear"), "period_s": ("period_s", PERIODS, "s", "log")}


def dataset(*axes, columns=("stiffness", "mass"), lost=None, seed=1):
    """A study of random values over named axes, as a sweep returns it; `lost` is put where the first one is 0."""
    random = np.random.default_rng(seed)
    coords, dims = {}, []
    for key in axes:
        dims.append(key)
        if key in KEYS:
            _, values, unit, scale = KEYS[key]
            coords[key] = (key, values, {"units": unit, "long_name": key, "scale": scale, "role": "axis"})
        else:
            coords[key] = (key, NAMES, {"units": "", "long_name": key, "role": "axis"})
    shape = tuple(len(coords[key][1]) for key in dims)
    data = {}
    for n, name in enumerate(columns):
        values, status = random.uniform(1e3, 9e3, shape), np.full(shape, OK, dtype=np.uint8)
        if lost is not None:
            status[0] = lost
            values[0] = np.nan
        about = {"unit": ["N/m", "kg", ""][n], "title": name.capitalize(), "key": name, "better": "higher"}
        data[name], data[f"{name}_status"] = (dims, values, about), (dims, status)
    return xr.Dataset(data, coords)


def hypercube(count=30, lost=0):
    random = np.random.default_rng(2)
    coords = {
        "design": np.arange(count),
        "length_m": ("design", random.uniform(0.1, 0.2, count), {"units": "m", "role": "axis", "scale": "linear"}),
        "tied_m": ("design", random.uniform(0.1, 0.2, count), {"units": "m"}),
        "assembly": ("design", [NAMES[n % 3] for n in range(count)], {"units": "", "role": "axis"}),
    }
    values, status = random.uniform(1.0, 2.0, count), np.full(count, OK, dtype=np.uint8)
    values[:lost], status[:lost] = np.nan, FAILED
    about = {"unit": "kg", "title": "Rigid mass", "key": "mass", "better": ""}
    return xr.Dataset({"mass": ("design", values, about), "mass_status": ("design", status)}, coords)


def panels_of(made):
    """The panels, after drawing."""
    made.canvas.draw()
    return made.axes


def texts(made):
    legends = [ax.get_legend() for ax in made.axes if ax.get_legend()] + list(made.legends)
    return [text.get_text() for legend in legends for text in legend.get_texts()]


def test_curves_over_one_axis_a_panel_for_each_column():
    data = dataset("length_m")
    panels = panels_of(study_figure(data))
    assert len(panels) == 2
    for panel, name in zip(panels, ("stiffness", "mass"), strict=True):
        (line,) = panel.lines
        assert np.array_equal(line.get_xydata(), np.column_stack([LENGTHS, data[name]]))
    assert panels[0].get_ylabel() == "Stiffness [kN/m]"
    assert panels[1].get_ylabel() == "Mass [kg]"
    assert [panel.get_xlabel() for panel in panels] == ["", "length_m [m]"]


def test_axes_end_where_the_designs_do():
    heat = study_figure(dataset("length_m", "period_s", columns=("mass",)))
    assert heat.axes[0].get_xlim() == (LENGTHS[0], LENGTHS[-1])
    (panel,) = panels_of(study_figure(dataset("length_m", columns=("mass",))))
    low, high = panel.get_xlim()
    assert 0.0 < LENGTHS[0] - low < 0.05 * (LENGTHS[-1] - LENGTHS[0])
    assert 0.0 < high - LENGTHS[-1] < 0.05 * (LENGTHS[-1] - LENGTHS[0])


def test_a_line_for_each_assembly_in_order_of_the_legend():
    data = dataset("assembly", "length_m", columns=("mass",))
    made = study_figure(data)
    (panel,) = panels_of(made)
    assert texts(made) == [f"assembly {name}" for name in NAMES]
    for line, name in zip(panel.lines, NAMES, strict=True):
        assert np.array_equal(line.get_ydata(), data["mass"].sel(assembly=name))
    assert len({(line.get_color(), str(line.get_linestyle())) for line in panel.lines}) == 3


@pytest.mark.parametrize("lost", [OUT_OF_REACH, NO_VALUE, FAILED])
def test_gaps_are_marked_below_all_curves(lost):
    data = dataset("assembly", "length_m", columns=("mass",), lost=lost)
    made = study_figure(data)
    (panel,) = panels_of(made)
    assert STATUS[lost] in texts(made)
    feet = [
        line
        for line in panel.lines
        if line.get_transform() == panel.get_xaxis_transform() and len(line.get_xdata())
    ]
    (foot,) = [line for line in feet if line.get_linestyle() == "None"]
    assert np.array_equal(foot.get_xdata(), LENGTHS)
    bottom, top = panel.get_ylim()
    height = (np.nanmin(data["mass"]) - bottom) / (top - bottom)
    assert foot.get_ydata().max() < height
    assert min(panel.get_yticks()) >= 0.0


def test_texts_alone_are_points():
    data = dataset("assembly", columns=("mass",))
    (panel,) = panels_of(study_figure(data))
    (line,) = panel.lines
    assert line.get_linestyle() == "None"
    assert [label.get_text() for label in panel.get_xticklabels()] == NAMES


def test_heat_maps_over_two_axes_each_cell_in_its_place():
    data = dataset("period_s", "length_m", lost=FAILED)
    made = study_figure(data)
    panels = panels_of(made)
    assert len(panels) == 2
    assert texts(made) == ["failed"]
    for panel, name in zip(panels, ("stiffness", "mass"), strict=True):
        (mesh,) = [found for found in panel.collections if isinstance(found, QuadMesh)]
        shown = mesh.get_array()
        assert shown.shape == (5, 4), "the first axis lies along x"
        assert np.array_equal(
            np.ma.filled(shown, np.nan), data[name].transpose("length_m", "period_s"), equal_nan=True
        )
        corners = mesh.get_coordinates()
        x, y = corners[0, :, 0], corners[:, 0, 1]
        assert ((x[:-1] < PERIODS) & (x[1:] > PERIODS)).all()
        assert np.allclose(np.diff(np.log(x)), np.log(PERIODS[1] / PERIODS[0])), "by ratio, as the axis is divided"
        assert ((y[:-1] < LENGTHS) & (y[1:] > LENGTHS)).all()
        assert panel.get_xscale() == "log"
        assert panel.get_ylabel() == "length_m [m]"
        hatched = [found for found in panel.collections if found.get_hatch()]
        assert len(hatched) == 1
        assert np.ma.count(hatched[0].get_array()) == 5


def test_heat_maps_of_each_assembly_have_one_scale():
    data = dataset("length_m", "period_s", "assembly", columns=("mass",))
    panels = panels_of(study_figure(data))
    assert [panel.get_title(loc="left") for panel in panels] == [f"assembly {name}" for name in NAMES]
    norms = [next(c for c in panel.collections if isinstance(c, QuadMesh)).norm.boundaries for panel in panels]
    assert all(np.array_equal(norm, norms[0]) for norm in norms)


def test_parallel_coordinates_have_an_upright_for_each_axis_and_column():
    made = study_figure(hypercube(lost=4))
    (panel,) = panels_of(made)
    names = [text.get_text() for text in panel.texts]
    assert {"length_m [m]", "assembly", "Rigid mass [kg]", "4 without", "colour: rigid mass"} <= set(names)
    assert not any("tied" in name for name in names)
    lines = [found for found in panel.collections if isinstance(found, LineCollection)]
    whole = lines[0].get_segments()
    assert len(whole) == 26
    assert {len(one) for one in whole} == {3}
    heights = np.array([one[:, 1] for one in whole])
    assert heights.min() == 0.0
    assert heights.max() == 1.0
    data = hypercube(lost=4)
    mass = data["mass"].values[4:]
    assert np.allclose(np.sort(heights[:, 2]), np.sort((mass - mass.min()) / np.ptp(mass)))


def test_a_grid_of_many_axes_is_drawn_by_parallel_coordinates():
    data = dataset("length_m", "period_s", "assembly", columns=("stiffness", "mass", "ratio"))
    data = data.expand_dims(model=["full", "rigid"])
    data["model"].attrs.update(units="", long_name="model", role="axis")
    (panel,) = panels_of(study_figure(data))
    lines = [found for found in panel.collections if isinstance(found, LineCollection)]
    assert len(lines[0].get_segments()) == 2 * 5 * 4 * 3


@pytest.mark.parametrize(
    "axes", [("length_m",), ("length_m", "period_s"), ("assembly",), ("assembly", "length_m"), ("design",)]
)
def test_a_study_in_which_nothing_has_a_value_is_drawn_all_the_same(axes):
    data = hypercube(6, lost=6) if axes == ("design",) else dataset(*axes)
    for name in [n for n in data.data_vars if f"{n}_status" in data]:
        data[name] = data[name] * np.nan
        data[f"{name}_status"] = data[f"{name}_status"] * 0 + FAILED
        data[name].attrs = {"unit": "kg", "title": "Mass"}
    panels_of(study_figure(data))


def test_one_design_is_drawn():
    panels_of(study_figure(dataset("length_m", "period_s").isel(length_m=[0], period_s=[0])))
    panels_of(study_figure(dataset("length_m").isel(length_m=[0])))


def test_a_logarithmic_axis_is_numbered_below_the_last_panel_only():
    upper, lower = panels_of(study_figure(dataset("period_s")))
    assert upper.get_xscale() == lower.get_xscale() == "log"
    shown = [
        [text.get_text() for text in panel.get_xticklabels(which="both") if text.get_visible() and text.get_text()]
        for panel in (upper, lower)
    ]
    assert shown[0] == []
    assert len(shown[1]) >= 2
    assert not any("10^" in text for text in shown[1])


def test_an_axis_of_one_value_is_told_beside_the_curves():
    made = study_figure(dataset("length_m", "period_s", columns=("mass",)).isel(length_m=[2]))
    (panel,) = panels_of(made)
    assert panel.get_xlabel().startswith("period_s")
    assert len(panel.lines) == 1
    assert texts(made)[0].startswith("length_m 0.")


def test_the_same_bytes_from_the_same_numbers(tmp_path):
    for axes in (("assembly", "length_m"), ("length_m", "period_s")):
        files = [save(study_figure(dataset(*axes)), tmp_path / f"{n}.svg").read_bytes() for n in range(2)]
        assert files[0] == files[1]


def test_names_of_uprights_fit_between_them():
    assert _in_lines("links.upper-right.length_m [m]") == "links.\nupper-right.\nlength_m [m]"
    assert _in_lines("Largest virtual stiffness [kN/m]") == "Largest virtual\nstiffness [kN/m]"


def test_values_listed_in_any_order_are_drawn_in_theirs():
    data = dataset("length_m", "period_s", columns=("mass",))
    mixed = data.isel(length_m=[3, 0, 4, 1, 2], period_s=[1, 0, 3, 2])
    meshes = [
        next(c for c in panels_of(study_figure(one))[0].collections if isinstance(c, QuadMesh))
        for one in (data, mixed)
    ]
    assert np.array_equal(meshes[0].get_array(), meshes[1].get_array())
