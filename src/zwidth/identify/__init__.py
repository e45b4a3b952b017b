"""From measurements of a device to numbers of its file, each with an interval that holds it with 95 %."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
