"""Models of a device: mechanisms and their postures, plants, operators, measured responses."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
