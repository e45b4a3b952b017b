from .device import Device as Device
from .faults import DeviceError as DeviceError
from .load import from_document as from_document
from .load import load as load
from .load import schema as schema
from .read import bundled as bundled
