from .device import Device as Device
from .faults import DeviceError as DeviceError
from .load import from_document as from_document
from .new_device import new_device as new_device
from .read import bundled as bundled
from .robot_files.import_file import import_file as import_file
