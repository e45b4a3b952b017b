"""The device file: reading it, checking it, and addressing its numbers.

load       `load(name_or_path, settings)`, `bundled()`, `schema()`
device     `Device`, with `posture()` and `plant()`
faults     `DeviceError` and its `Fault`s
address    dotted paths: get, assign, unset, numeric_addresses
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
