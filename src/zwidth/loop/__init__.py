"""The sampled loop: controllers, filters, velocity estimates, holds, operating points."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
