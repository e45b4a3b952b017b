"""Every result: keys and columns, a few lines, a figure, a page of a notebook."""

from __future__ import annotations

import inspect
import json
import math
import re

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.axes import Axes

import zwidth
from tests.identify.spring_bench import bench_record
from tests.public_names import public_names
from zwidth.result import Result
from zwidth.show import json_value
from zwidth.show.figures.plots import DRAWINGS
from zwidth.study import plane_of, study_of, study_over

LINES = 8
PACKAGES = ["chart", "conditions", "contact", "guarantees", "loop", "measures", "model", "study"]


def device():
    return zwidth.load("published-two-mass", {"friction.coulomb_N": [0.3, 0.1]}, operator="thesis-arm")


def rubbing():
    return zwidth.load("hapkit-course", {"loop.saturation.force_N": 5.0})


BEST_DESIGNS = {
    "device": "hapkit-course",
    "axis": [{"key": "plant.mass_kg", "range": [0.02, 0.1]}, {"key": "loop.delay_samples", "range": [0.0, 1.0]}],
    "optimise": {"objectives": {"stiffness_max": "max", "rigid_mass": "min"}, "budget": 40},
}


def results():
    point, arms = device().at(), zwidth.load("five-bar")
    single = zwidth.load("hapkit-course").at()  # one mass, of which searches take a tenth of the time
    family = zwidth.study.Family(
        device(), (zwidth.study.Range("operator.arm_mass_kg", 0.3, 1.0),), (), device().at()
    )
    plan = zwidth.study.Plan(stiffnesses=2, tips=1)
    return {
        "chart": point.chart(),
        "chart of several directions": arms.at(directions=np.eye(3)[:2]).chart(),
        "robust chart": zwidth.robust_chart([point.loop, point.without_operator.loop]),
        "robust study": zwidth.robust_study(family, members=6, unseen=8),
        "verdicts": point.check([1000.0, 1e5], [5.0, 5.0]),
        "by direction": arms.at().by_direction(count=8),
        "load path": arms.load_path(4.0, 3),
        "bending": arms.bending(),
        "description": arms.describe(),
        "description of a plant": point.describe(),
        "measured": arms.at([(0.0, 0.25), (0.05, 0.2), (9.0, 9.0)]).measure("isotropy"),
        "measured once": arms.measure("isotropy"),
        "bounds": point.bounds(),
        "guarantees": single.guarantees(coupling=True, wall=(1000.0, 5.0)),
        "felt": point.felt(1000.0, 5.0),
        "contact": point.simulate(1000.0, 5.0, duration=0.2),
        "motion": arms.at().move(
            zwidth.contact.SurfaceWall(1500.0, 3.0), zwidth.contact.Sphere((0.0, 0.31), 0.05), push=(0.02, 1.0)
        ),
        "limit cycles": rubbing().at().limit_cycles(2600.0, 0.0, simulate=False),
        "boundary": single.without_operator.measure_boundary(plan),
        "sensitivities": device().sensitivities(),
        "goal": zwidth.study.numbers_for_goal(device(), None, 8000.0),
        "identification": arms.identify(
            "stiffness", bench_record(1, forward=0.45, friction=0.003, amplitude=0.045), joint="upper-right"
        ),
        **function_results(point, single, arms),
    }


def function_results(point, single, arms):
    """Results of functions that are no verbs of an operating point."""
    loop, wall = point.without_operator.loop, zwidth.contact.ENVIRONMENTS["wall"]
    maps = zwidth.workspace_map(arms, "rigid_mass", plane_of(arms, cells=(15, 9)))
    designs = {"loop.sampling_period_s": [0.001, 0.0015], "loop.delay_samples": [0.0, 0.5, 1.0]}
    return {
        "felt chart": zwidth.measures.felt_chart(loop.chart()),
        "guarantee": zwidth.guarantees.spring_stable_region(single.loop),
        "validity": point.validity(),
        "response": zwidth.contact.simulate(
            loop, wall, wall.values(stiffness=1e3, damping=5.0), duration=0.2, start_position=1e-3
        ),
        "eigenvalue paths": zwidth.measures.wall_paths(loop, np.linspace(1e3, 1e5, 9), 5.0),
        "common area": zwidth.study.common_area(maps, [zwidth.study.parse_requirement("rigid_mass>=0.25")]),
        "safe walls": zwidth.study.safe_walls(device()),
        "tolerances": zwidth.study.tolerance(
            zwidth.load("hapkit-course"),
            {"plant.mass_kg": {"distribution": "uniform", "plus_minus_percent": 5}},
            stiffness=1000.0,
            damping=5.0,
            samples=72,
            index_samples=32,
        ),
        "best designs": zwidth.study.optimise(study_of(BEST_DESIGNS, bounds=True), workers=1),
        "designs": zwidth.run_study(study_over(device(), designs, "stiffness_max")),
        "designs of one number": zwidth.run_study(
            study_over(device(), {"plant.mass_kg.0.0": [0.2, 0.3]}, "stiffness_max")
        ),
    }


@pytest.fixture(scope="module")
def all_results():
    return results()


# What is on the way to results: devices, plants, loops, and what they are made of or asked with.
STAGES = """
    Device OperatingPoint Posture Plant MultiPlant Response Loop Controller Estimator AlphaBeta Nonlinear
    Measure Requirement Environment PlaneGrid Study RangeFault CellValues MeasureError ForceLaw Function UserPoint
    Walls Family FamilyMember Executor ToleranceQuestion MemberChanges
"""
# Plain values, arrays, and a few numbers by name, such as the rows of a result; datasets show themselves.
NUMBERS = """
    Any Self None bool int float str complex dict list tuple Iterator Callable NDArray np bool_ complex128 float64
    Floats Complexes Flags Ints ArrayLike Mapping Sequence xr Dataset Axes Rectangle
    Peak FastestDecay EffectiveParameters ImpedanceRange OptimalMass Overall Judgement Bound LimitCycle Variant
"""

NAMES = [
    "chart",
    "chart of several directions",
    "robust chart",
    "robust study",
    "verdicts",
    "by direction",
    "load path",
    "bending",
    "description",
    "description of a plant",
    "measured",
    "measured once",
    "bounds",
    "guarantees",
    "felt",
    "contact",
    "motion",
    "limit cycles",
    "boundary",
    "sensitivities",
    "goal",
    "identification",
    "felt chart",
    "guarantee",
    "validity",
    "response",
    "eigenvalue paths",
    "common area",
    "designs",
    "designs of one number",
    "safe walls",
    "tolerances",
    "best designs",
]


@pytest.mark.parametrize("name", NAMES)
def test_a_result_knows_its_keys_and_columns(all_results, name):
    result = all_results[name]
    assert isinstance(result, Result)
    document = result.document()
    assert document
    assert all(isinstance(key, str) for key in document)
    json.dumps(json_value(document), allow_nan=False)
    table = result.table()
    assert table
    assert len({len(column) for column in table.values()}) == 1


@pytest.mark.parametrize("name", NAMES)
def test_a_result_shows_itself_in_a_few_lines(all_results, name):
    text = repr(all_results[name])
    assert 1 <= len(text.splitlines()) <= LINES
    assert max(map(len, text.splitlines())) <= 240
    assert "array(" not in text


# Units of a few lines, and how keys end that have them.
ENDINGS = {"N/m": "_N_per_m", "N s/m": "_Ns_per_m", "N² s/m²": "_N2s_per_m2", "Hz": "_Hz", "kg": "_kg"}
ENDINGS |= {"N": "_N", "m": "_m", "s": "_s", "1/s": "_per_s", "m²": "_m2"}
UNITS = "|".join(map(re.escape, ENDINGS))
NUMBER = re.compile(rf"(?<![\w.])(-?\d[\d.]*(?:e[+-]?\d+)?) ({UNITS})(?![\w/^]| [sm]\b)")


def numbers_by_key(value, key=""):
    """Every number of a document or table with its key; one of a list, or by a name, with that of the whole."""
    if isinstance(value, dict):
        for name, own in value.items():
            yield from numbers_by_key(own, name if name.endswith(tuple(ENDINGS.values())) else key or name)
    elif isinstance(value, list):
        for own in value:
            yield from numbers_by_key(own, key)
    elif isinstance(value, float):
        yield key, abs(value)


@pytest.mark.parametrize("name", NAMES)
def test_the_numbers_of_a_few_lines_are_those_of_the_document_in_the_same_unit(all_results, name):
    result = all_results[name]
    numbers = set(numbers_by_key(json_value([result.document(), dict(result.table())])))
    for text, unit in NUMBER.findall(repr(result)):
        own = [value for key, value in numbers if key.endswith(ENDINGS[unit])]
        assert any(text.lstrip("-") in {f"{value:.{digits}g}" for digits in (4, 5, 6)} for value in own), text


@pytest.mark.parametrize("name", NAMES)
def test_columns_are_the_lists_of_the_document(all_results, name):
    document, table = all_results[name].document(), all_results[name].table()
    for key in document.keys() & table.keys():
        if isinstance(document[key], np.ndarray) and document[key].ndim == 1:
            np.testing.assert_array_equal(table[key], document[key])


@pytest.mark.parametrize("name", NAMES)
def test_a_result_draws_itself_and_stands_in_a_notebook(all_results, name):
    result = all_results[name]
    if not DRAWINGS.keys() & {kind.__name__ for kind in type(result).__mro__}:
        assert "<svg" not in result._repr_html_()
        return
    figure, ax = pyplot.subplots()
    assert result.plot(ax) is ax
    assert ax.lines or ax.collections or ax.patches or ax.images or ax.texts
    pyplot.close(figure)
    own = result.plot()
    assert isinstance(own, Axes)
    assert own is not ax
    pyplot.close(own.figure)
    page = result._repr_html_()
    assert page.startswith("<pre>")
    assert "<svg" in page


def test_two_figures_of_one_notebook_share_no_id(all_results):
    pages = [all_results[NAMES[0]]._repr_html_() for _ in range(2)]
    first, second = (set(re.findall(r' id="([^"]+)"', page)) for page in pages)
    assert first
    assert second
    assert not first & second


def test_every_kind_of_result_is_tried(all_results):
    tried = {kind.__name__ for result in all_results.values() for kind in type(result).__mro__}
    assert DRAWINGS.keys() - tried == {"Couplings"}  # which `guarantees` carries
    kinds = {kind.__name__ for kind in _subclasses(Result)}
    # of measured devices and of records, which tests of their own make
    elsewhere = {
        "MeasuredChart",
        "MeasuredVerdicts",
        "MeasuredRobustChart",
        "JointIdentification",
        "ArmIdentification",
    }
    assert kinds - tried - elsewhere - {"Couplings"} == set()


def test_whatever_a_public_function_returns_is_a_result_or_known_not_to_be(all_results):
    """Read off the annotations: a new type has to become a `Result`, or be named above."""
    assert all_results  # with them every kind of result is imported
    known = {*STAGES.split(), *NUMBERS.split()} | {kind.__name__ for kind in _subclasses(Result)}
    unknown = {
        f"{word} of {where}"
        for where, returned in _return_annotations()
        for word in re.findall(r"\w+", re.sub(r"Literal\[.*?\]", "", returned))
        if word not in known
    }
    assert not unknown


def test_a_motion_that_ends_before_its_first_sample_has_nulls():
    motion = zwidth.load("five-bar").at((0.0, 0.346 - 5e-8)).move(duration=0.1)
    assert len(motion.time) == 0
    document = json_value(motion.document())
    assert document["duration_s"] is document["energy_book_J"]["hand"] is document["force_limit_share"] is None
    assert "singularity" in repr(motion)
    assert "singularity" in motion.plot().get_title(loc="left")
    pyplot.close("all")


def test_a_response_without_an_energy_ledger_has_columns_of_one_length():
    wall = zwidth.contact.ENVIRONMENTS["wall"]
    run = zwidth.contact.Run(device().at().loop, wall.values(stiffness=1e3, damping=5.0), start_position=1e-3)
    (response,) = zwidth.contact.simulate_batch([run], wall, duration=0.05)
    assert {len(column) for column in response.table().values()} == {len(response.time)}
    assert "energy_J" not in response.table()


@pytest.mark.parametrize("count", [3, 8])
def test_a_sweep_over_texts_is_drawn_however_many_there_are(count):
    periods = [0.001 + 1e-4 * n for n in range(count)]
    designs = study_over(
        device(), {"model": ["full", "rigid"], "operator.arm_mass_kg": [0.5], "loop.sampling_period_s": periods},
        "stiffness_max",
    )  # fmt: skip
    texts = study_over(
        zwidth.load("five-bar"),
        {"model": ["full", "two-mass"], "direction": [[np.cos(a), np.sin(a)] for a in periods]},
        "stiffness_max",
    )
    for study in (designs, texts):
        ax = zwidth.run_study(study).plot()
        ax.figure.draw_without_rendering()
        assert ax.lines or ax.collections
    pyplot.close("all")


def test_an_empty_guarantee_is_drawn_with_its_reason():
    loop = zwidth.Loop(zwidth.Plant.one_mass(0.1, 0.0), sampling_period=1e-3)
    region = zwidth.guarantees.passive_region(loop)
    said = " ".join(text.get_text() for text in region.plot().texts).replace("\n", " ")
    assert region.reason
    assert region.reason.split(";")[0] in said
    pyplot.close("all")


def test_what_has_no_drawing_says_so_and_stands_in_a_notebook_with_its_lines():
    class Bare(Result):
        """Nothing."""

        def __repr__(self):
            return "2 kg & no figure"

    assert Bare()._repr_html_() == "<pre>2 kg &amp; no figure</pre>"
    with pytest.raises(TypeError, match="a Bare"):
        Bare().plot()


def test_a_single_measure_is_a_number(all_results):
    assert math.isclose(float(all_results["measured once"]), 1.37612507, rel_tol=1e-6)


def _subclasses(kind):
    for one in kind.__subclasses__():
        if one.__module__.startswith("zwidth"):
            yield one
            yield from _subclasses(one)


def _return_annotations():
    """(name, annotation) of every public function, and of every public method of a public class."""
    faces = [("", zwidth), *((name, getattr(zwidth, name)) for name in PACKAGES)]
    for package, face in faces:
        for name in public_names(package):
            thing = getattr(face, name)
            if inspect.isfunction(thing):
                yield name, str(thing.__annotations__.get("return", "missing"))
            elif inspect.isclass(thing):
                for method, function in inspect.getmembers(thing, inspect.isfunction):
                    if not method.startswith("_") and function.__module__.startswith("zwidth"):
                        yield f"{name}.{method}", str(function.__annotations__.get("return", "missing"))
