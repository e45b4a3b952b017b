from .device import Device as Device
from .load import from_document as from_document
from .read import bundled as bundled
from .read import new_device as new_device
from .robot_files.import_file import import_file as import_file

# Inner names, for tests and neighbouring packages: they may change with any release.
# isort: split
from .address import edited_text as edited_text
from .numbers import DeviceNumber as DeviceNumber
from .numbers import device_numbers as device_numbers
from .plausibility import implausible as implausible
from .read import OPERATORS as OPERATORS
from .read import bundled_names as bundled_names
