"""The device files of the record: right where they are to be, wrong where they are to be, the same every time."""

from __future__ import annotations

import pytest

import zwidth
from tests.frozen.devices import faulty_devices, random_devices, studies
from tests.frozen.plants import FEATURES
from tests.frozen.toml_text import toml_text
from zwidth.errors import DeviceError

DEVICES = random_devices()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("files")
    for device in [*DEVICES, *faulty_devices()]:
        for name, text in device.files.items():
            (made / name).write_text(text)
    return made


def test_there_are_sixty_and_each_is_the_same_again():
    assert len(DEVICES) == 60
    assert len({device.word for device in DEVICES}) == 60
    assert random_devices() == DEVICES
    assert studies() == studies()


def test_every_feature_stands_in_some_file():
    texts = [device.files[device.word] for device in DEVICES]
    words = ["delay_samples", "filter", "force", "actuator", "encoder", "friction", "saturation", "operator"]
    words += ["electrical_damping", "spring", "brake", "loss_factor", "foaw", "loops", "coulomb_Nm", "files"]
    assert len(FEATURES) == 14
    for word in words:
        assert sum(word in text for text in texts) >= 1, word
    assert {device.kind for device in DEVICES} == {"plant", "mechanism", "response", "unanswered"}
    assert 15 < sum(device.quantised for device in DEVICES) < 45


@pytest.mark.filterwarnings("ignore::zwidth.device.plausibility.ImplausibleNumber")
def test_every_file_is_valid(folder):
    for device in DEVICES:
        zwidth.load(folder / device.word)


@pytest.mark.parametrize("device", faulty_devices(), ids=lambda device: device.word)
def test_files_with_a_slip_are_refused(folder, device):
    with pytest.raises(DeviceError):
        zwidth.load(folder / device.word)


def test_toml_text_writes_what_it_was_given():
    import tomllib

    table = {"a": {"b c": [1, 2.5, [True, 'x"y']]}, "d-e": {"f": 1e-7}}
    assert tomllib.loads(toml_text(table)) == table
