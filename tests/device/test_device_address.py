"""Dotted paths: what `--set` reaches, what it says when it reaches nothing."""

from __future__ import annotations

import pytest

from tests.device.device_cases import ARM_FILE, PLANT_FILE, with_changes
from zwidth.device import address, bundled_names, from_document
from zwidth.device.load import load
from zwidth.device.read import read
from zwidth.errors import DeviceError
from zwidth.loop import Butterworth, FirstOrder


def error_message(setting: str, text: str = ARM_FILE) -> str:
    with pytest.raises(DeviceError) as caught:
        address.apply(with_changes(text), [setting])
    (fault,) = caught.value.faults
    assert fault.file == "settings"
    return str(fault)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("mechanism.links.upper.length_m", 0.2),
        ("links.upper.length_m", 0.2),
        ("links.1.parent", "upper"),
        ("links.lower.center_of_mass_m.0", 0.1),
        ("mechanism.assemblies.elbow-down.joints_rad.lower", 1.0),
        ("reference.direction", [1.0, 0.0]),
        ("drives.shoulder.stiffness_Nm_per_rad", 0.5),
        ("loop.sampling_period_s", 0.001),
        ("name", "two links"),
    ],
)
def test_get(path, value):
    assert address.get(with_changes(ARM_FILE), path) == value


@pytest.mark.parametrize(
    ("setting", "value"),
    [
        ("links.upper.length_m=0.25", 0.25),
        ("links.0.length_m = 1e-1", 0.1),
        ("reference.position_m=[0.1, 0.3]", [0.1, 0.3]),
        ("drives.elbow.stiffness_Nm_per_rad=inf", float("inf")),
        ("links.lower.center_of_mass_m.0=-0.1", -0.1),
        ("name=seven", "seven"),
        ("name='7'", "7"),
        ("name=a = b", "a = b"),
        ("loop.delay_samples=1", 1),  # the schema has it, the file leaves it out
        ("loop.velocity.filter.order=2", 2),
        ("mechanism.workspace.x_m=[0, 1]", [0, 1]),
    ],
)
def test_set(setting, value):
    document = with_changes(ARM_FILE)
    result = address.apply(document, [setting])
    assert address.get(result, setting.partition("=")[0].strip()) == value
    assert document == with_changes(ARM_FILE), "the document given is left alone"


def test_an_element_of_a_matrix():
    device = from_document(
        address.apply(with_changes(PLANT_FILE), ["plant.mass_kg.0.0=0.5", ("plant.mass_kg.1.1", 0.01)])
    )
    assert device.given_plant.mass.tolist() == [[0.5, 0.0], [0.0, 0.01]]


@pytest.mark.parametrize(
    ("settings", "samples"),
    [
        ([], 0.5),
        (["loop.delay_s=0.002"], 2.0),
        (["loop.delay_s=0.002", "loop.delay_samples=3"], 3.0),
        (["loop.delay_samples=unset"], 0.0),
        (["loop.delay_s=0.002", "loop.sampling_period_s=0.004"], 0.5),
    ],
)
def test_setting_one_of_two_exclusive_keys_drops_the_other(settings, samples):
    assert from_document(address.apply(with_changes(PLANT_FILE), settings)).controller.delay == pytest.approx(
        samples
    )


def test_setting_one_way_of_damping_drops_the_others():
    document = address.apply(
        with_changes(ARM_FILE), ["damping.stiffness_coefficient_s=1e-4", "damping.mass_coefficient_1_per_s=2"]
    )
    assert document["mechanism"]["damping"] == {
        "stiffness_coefficient_s": 1e-4,
        "mass_coefficient_1_per_s": 2,
    }
    document = address.apply(document, ["damping.given=true"])
    assert document["mechanism"]["damping"] == {"given": True}


def test_one_filter_can_be_set_for_the_other():
    filters = "loop.velocity.filter"
    settings = [f"{filters}.type=first-order", f"{filters}.time_constant_s=0.01"]
    document = address.apply(with_changes(PLANT_FILE), settings)
    assert from_document(document).controller.velocity_filter == FirstOrder(0.01)
    settings = [f"{filters}.type=butterworth", f"{filters}.order=4", f"{filters}.cutoff_Hz=30"]
    assert from_document(address.apply(document, settings)).controller.velocity_filter == Butterworth(4, 30.0)
    assert from_document(address.apply(document, [f"{filters}=unset"])).controller.velocity_filter is None


def test_a_key_of_the_other_filter_makes_it_that_filter():
    filters = "loop.velocity.filter"
    document = address.apply(with_changes(PLANT_FILE), [f"{filters}.time_constant_s=0.001"])
    assert document["loop"]["velocity"]["filter"] == {"type": "first-order", "time_constant_s": 0.001}
    assert from_document(document).controller.velocity_filter == FirstOrder(0.001)
    back = address.apply(document, [f"{filters}.cutoff_Hz=30", f"{filters}.order=4"])
    assert from_document(back).controller.velocity_filter == Butterworth(4, 30.0)


def test_a_key_that_drops_nothing_leaves_the_type_alone():
    filters = "loop.velocity.filter"
    settings = [f"{filters}=unset", f"{filters}.type=first-order", f"{filters}.order=2"]
    document = address.apply(with_changes(PLANT_FILE), settings)
    assert document["loop"]["velocity"]["filter"] == {"type": "first-order", "order": 2}


def test_unset_removes_and_what_is_not_there_is_no_fault():
    document = with_changes(ARM_FILE)
    assert (
        "stiffness_Nm_per_rad"
        not in address.unset(document, "drives.shoulder.stiffness_Nm_per_rad")["mechanism"]["drives"][0]
    )
    assert address.unset(document, "loop.delay_s") == document
    assert address.unset(document, "loop.velocity.filter.order") == document
    assert len(address.unset(document, "drives.1")["mechanism"]["drives"]) == 1
    assert address.apply(document, ["name='unset'"])["name"] == "unset"


def test_a_plant_has_no_shorthand():
    assert "links.upper.length_m: is not" in error_message("links.upper.length_m=1", PLANT_FILE)


def test_all_settings_at_fault_are_reported_together():
    with pytest.raises(DeviceError) as caught:
        load("five-bar", ["colour=red", "links.upper-left.mas_kg=1", "loop.delay_samples=1"])
    assert [fault.key for fault in caught.value.faults] == ["colour", "links.upper-left.mas_kg"]


def test_settings_are_checked_after_all_are_applied():
    """Each alone puts a filter's cutoff above half the sampling frequency or its table in pieces."""
    settings = [
        "loop.velocity.filter.cutoff_Hz=600",
        "loop.velocity.filter.order=2",
        "loop.velocity.filter.type=butterworth",
        "loop.sampling_period_s=0.0005",
    ]
    assert load("five-bar", settings).controller.velocity_filter == Butterworth(2, 600.0)


@pytest.mark.parametrize("name", bundled_names())
def test_every_number_has_an_address_that_leads_back_to_it(name):
    document, _ = read(name)
    numbers = address.numeric_addresses(document)
    assert "loop.sampling_period_s" in numbers or "sampling_period_s" not in document["loop"]  # not known
    for path, value in numbers.items():
        assert address.get(document, path) == value
        assert address.get(address.assign(document, path, 12.5), path) == 12.5
